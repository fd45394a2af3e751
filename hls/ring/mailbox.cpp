// Task mailbox of the ring: whether a ray has just been tested against a triangle: its last triangles, the oldest replaced.
#include "tasks.hpp"

extern "C" void ring_mailbox(hls::stream<retrace::hls::token_word_t>& in, hls::stream<retrace::hls::token_word_t>& out,
                             ap_uint<32> mailbox) {
  using namespace retrace::hls;
  // clang-format off
#pragma HLS interface mode=axis port=in
#pragma HLS interface mode=axis port=out
  // clang-format on
  token_word_t mails[RETRACE_RING_CONTEXTS];
  RT_LAP(mails)
MAILBOX:
  for (unsigned long long i = 0; i < kRingIterations; ++i) {
    RT_PIPELINE(1)  // one comparison with all entries a token
    token t = unpack_token(in.read());
    token_word_t mail = mails[t.id.to_uint()];
    if (t.fresh) mail = 0;
    if (mailbox != 0 && t.test) {
      // An entry of 32 bits: the triangle and, above it, whether it is one.
      ap_uint<32> wanted = t.ref;
      wanted[31] = 1;
      token_word_t rest = mail;
    MAIL:
      for (int entry = 0; entry < RETRACE_RING_MAILBOX; ++entry) {
        RT_UNROLL
        const ap_uint<32> held = rest;
        if (held == wanted) t.skipped = 1;
        rest >>= 32;
      }
      if (!t.skipped) {
        mail <<= 32;
        mail |= token_word_t(wanted);
      }
    }
    mails[t.id.to_uint()] = mail;
    out.write(pack_token(t));
    if (t.phase == kTokenEnd) break;
  }
}
