// The text of hls/top/trace.cpp is compiled a second time with a witness around each stage function, so that what is watched is the kernel itself.
#include "watched_trace.hpp"

#include <cstring>

#include "hls/stages/hit_finish.hpp"
#include "hls/stages/instance_enter.hpp"
#include "hls/stages/kd_backtrack.hpp"
#include "hls/stages/kd_descend.hpp"
#include "hls/stages/leaf_exit.hpp"
#include "hls/stages/ray_setup.hpp"
#include "hls/stages/tri_test.hpp"

namespace {

thread_local const retrace::StageWitness* witness_of_thread = nullptr;

/// Tells the witness what a stage was given and what it gave; the records as 64-bit words, as in memory.
template <std::size_t InWords, std::size_t OutWords>
void tell(retrace::Stage stage, const retrace::hls::word_t (&in)[InWords],
          const retrace::hls::word_t (&out)[OutWords]) {
  std::uint64_t input[2 * InWords], output[2 * OutWords];
  static_assert(sizeof in == sizeof input && sizeof out == sizeof output);
  // NOLINTNEXTLINE(bugprone-undefined-memory-manipulation): csim_engine checks that a word is two 64-bit words
  std::memcpy(input, in, sizeof in);
  std::memcpy(output, out, sizeof out);
  (*witness_of_thread)(stage, input, output);
}

}  // namespace

namespace retrace::hls {

// NOLINTBEGIN(bugprone-macro-parentheses): names of functions and types are put together
#define RETRACE_WATCHED(name, stage, in_record, in_words, out_record, out_words) \
  static out_record watched_##name(const in_record##_record& given) {            \
    const out_record result = name(given);                                       \
    word_t in[in_words], out[out_words];                                         \
    pack_##in_record(given, in);                                                 \
    RETRACE_PACK_##name(result, out);                                            \
    tell(stage, in, out);                                                        \
    return result;                                                               \
  }
#define RETRACE_PACK_ray_setup pack_ray_setup_out
#define RETRACE_PACK_kd_descend pack_kd_descend_out
#define RETRACE_PACK_leaf_exit pack_leaf_exit_out
#define RETRACE_PACK_tri_test pack_tri_test_out
#define RETRACE_PACK_kd_backtrack pack_kd_backtrack_out
#define RETRACE_PACK_hit_finish pack_hit
#define RETRACE_PACK_instance_enter pack_instance_enter_out
RETRACE_WATCHED(ray_setup, Stage::kRaySetup, ray_setup_in, kRaySetupInWords, ray_setup_out_record, kRaySetupOutWords)
RETRACE_WATCHED(kd_descend, Stage::kKdDescend, kd_descend_in, kKdDescendInWords, kd_descend_out_record,
                kKdDescendOutWords)
RETRACE_WATCHED(leaf_exit, Stage::kLeafExit, leaf_exit_in, kLeafExitInWords, leaf_exit_out_record, kLeafExitOutWords)
RETRACE_WATCHED(tri_test, Stage::kTriTest, tri_test_in, kTriTestInWords, tri_test_out_record, kTriTestOutWords)
RETRACE_WATCHED(kd_backtrack, Stage::kKdBacktrack, kd_backtrack_in, kKdBacktrackInWords, kd_backtrack_out_record,
                kKdBacktrackOutWords)
RETRACE_WATCHED(hit_finish, Stage::kHitFinish, hit_finish_in, kHitFinishInWords, hit_record, kHitWords)
RETRACE_WATCHED(instance_enter, Stage::kInstanceEnter, instance_enter_in, kInstanceEnterInWords,
                instance_enter_out_record, kInstanceEnterOutWords)
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace retrace::hls

#define ray_setup watched_ray_setup
#define kd_descend watched_kd_descend
#define leaf_exit watched_leaf_exit
#define tri_test watched_tri_test
#define kd_backtrack watched_kd_backtrack
#define hit_finish watched_hit_finish
#define instance_enter watched_instance_enter
#define retrace_trace retrace_watched_trace
extern "C" void retrace_watched_trace(const retrace::hls::word_t* pairs, const retrace::hls::word_t* leaves,
                                      const retrace::hls::word_t* list, const retrace::hls::word_t* triangles,
                                      const retrace::hls::word_t* rays, retrace::hls::word_t* hits,
                                      retrace::hls::word_t* work, ap_uint<64>* summary, ap_uint<32> image_lines,
                                      ap_uint<32> ray_count, ap_uint<8> options);
// The functions of this file must not be taken for those of the same name in the unwatched kernel.
#define inline static inline
#include "hls/top/trace.cpp"  // NOLINT(bugprone-suspicious-include)
#undef inline

namespace retrace {

void watched_trace(const StageWitness& witness, const hls::word_t* image, const hls::word_t* rays, hls::word_t* hits,
                   ap_uint<64>* summary, ap_uint<32> image_lines, ap_uint<32> ray_count, ap_uint<8> options) {
  witness_of_thread = &witness;
  retrace_watched_trace(image, image, image, image, rays, hits, nullptr, summary, image_lines, ray_count, options);
  witness_of_thread = nullptr;
}

}  // namespace retrace
