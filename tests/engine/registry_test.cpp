// The registry of engines, with engines of this test only.
#include "golden/engine/registry.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace retrace {
namespace {

class Nothing final : public Engine {
 public:
  explicit Nothing(std::string name) : name_(std::move(name)) {}
  std::string name() const override { return name_; }
  void trace(std::span<const GridRay>, std::span<Hit>, std::span<RayWork>, const TraceOptions&) override {}

 private:
  std::string name_;
};

EngineKind kind_of(const std::string& name) {
  EngineKind kind;
  kind.name = name;
  kind.help = "of the test";
  kind.make = [name](const GridScene&, const MemoryImage&, const std::string& argument) {
    return std::make_unique<Nothing>(name + "/" + argument);
  };
  return kind;
}

template <class Run>
std::string usage_error(const Run& run) {
  try {
    run();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

class Registry : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    register_engine(kind_of("plain"));
    EngineKind able = kind_of("able");
    able.takes_argument = able.stack = able.any_mailbox = true;
    able.check = [](const std::string& argument) {
      if (argument == "bad") throw UsageError("able: a bad argument");
    };
    register_engine(able);
    EngineKind exact = kind_of("exact");
    exact.fixed_point = false;
    register_engine(exact);
    EngineKind other = kind_of("other");
    other.takes_argument = true;
    other.same_hits = "otherwise";
    register_engine(other);
    register_absent_engine("absent", "build it in");
  }
};

TEST_F(Registry, FindsByName) {
  ASSERT_EQ(engine_kinds().size(), 4u);
  EXPECT_EQ(find_engine("plain").name, "plain");
  EXPECT_EQ(find_engine("able").name, "able");
  EXPECT_EQ(find_engine("able:x:y").name, "able");
  EXPECT_EQ(make_engine("able:x:y", {}, {})->name(), "able/x:y");
  EXPECT_EQ(make_engine("plain", {}, {})->name(), "plain/");
  EXPECT_NE(engine_help().find("able:ARGUMENT"), std::string::npos);
}

TEST_F(Registry, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(usage_error([] { find_engine("pla"); }), "there is no engine 'pla'; there are: plain, able, exact, other");
  EXPECT_EQ(usage_error([] { find_engine(""); }), "there is no engine ''; there are: plain, able, exact, other");
  EXPECT_EQ(usage_error([] { find_engine("plain:x"); }), "engine plain takes no argument: 'plain:x'");
  EXPECT_EQ(usage_error([] { find_engine("absent:x"); }), "this program was built without engine absent: build it in");
  EXPECT_THROW(register_engine(kind_of("plain")), std::logic_error);
  EXPECT_EQ(engine_kinds().size(), 4u);
}

TEST_F(Registry, AnEngineIsHeldAgainstItsLikeOrTheGoldenModel) {
  using Names = std::vector<std::string>;
  using Places = std::vector<std::size_t>;
  EXPECT_EQ(places_held_against(Names{"exact", "plain", "able"}), (Places{0, 0, 1}));
  EXPECT_EQ(places_held_against(Names{"plain", "exact", "able"}), (Places{0, 0, 0}));
  EXPECT_EQ(places_held_against(Names{"exact", "other:1", "plain", "other:2", "able"}), (Places{0, 0, 0, 1, 2}));
  EXPECT_EQ(places_held_against(Names{"plain", "exact", "other"}), (Places{0, 0, 1}));
  EXPECT_EQ(usage_error([] {
              places_held_against(Names{"plain", "other", "exact"});
            }),
            "engines plain and other choose among hits that are equally good: name golden before them");
}

TEST_F(Registry, ChecksOptions) {
  TraceOptions stack, odd, usual;
  stack.way_up = WayUp::kStack;
  odd.mailbox = kKernelMailbox + 1;
  usual.mailbox = kKernelMailbox;
  EXPECT_EQ(usage_error([&] { check_options("plain", stack); }), "engine plain has no stack: --way-up parent or face");
  EXPECT_EQ(usage_error([&] { check_options("plain", odd); }), "engine plain has a mailbox of 8 entries or none");
  EXPECT_EQ(usage_error([&] { check_options("plain", usual); }), "no error");
  for (const TraceOptions& options : {stack, odd, usual})
    EXPECT_EQ(usage_error([&] { check_options("able", options); }), "no error");
  EXPECT_EQ(usage_error([&] { check_options("able:bad", usual); }), "able: a bad argument");
}

}  // namespace
}  // namespace retrace
