// The program as a process: exit codes, one line an error, files that are whole, and the forms that scripts rely on.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "testbench/program/npy.hpp"

namespace retrace::cli {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

struct Outcome {
  int exit_code = -1, signal = 0;
  std::string out, err;
};

std::string text_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Program : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("retrace-program-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "logs");
    fs::create_directories(folder_ / "work");
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Runs in the work folder.
  pid_t start(const Arguments& arguments) {
    std::vector<char*> argv = {const_cast<char*>(RETRACE_PROGRAM)};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    const std::string work = (folder_ / "work").string(), out = (folder_ / "logs/out").string(),
                      err = (folder_ / "logs/err").string();
    const pid_t child = ::fork();
    if (child == 0) {
      const int out_file = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      const int err_file = ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      if (out_file < 0 || err_file < 0 || ::chdir(work.c_str()) != 0) ::_exit(126);
      ::dup2(out_file, STDOUT_FILENO);
      ::dup2(err_file, STDERR_FILENO);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    return child;
  }
  Outcome finish(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    Outcome outcome;
    if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
    outcome.out = text_of(folder_ / "logs/out");
    outcome.err = text_of(folder_ / "logs/err");
    return outcome;
  }
  Outcome run(const Arguments& arguments) { return finish(start(arguments)); }
  fs::path work(const std::string& name) const { return folder_ / "work" / name; }
  std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / "work"))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  void write(const std::string& name, const std::string& bytes) {
    std::ofstream(work(name), std::ios::binary) << bytes;
  }
  nlohmann::json json(const std::string& name) const { return nlohmann::json::parse(text_of(work(name))); }

  fs::path folder_;
};

bool is_png(const std::string& bytes) {
  return bytes.substr(0, 8) == "\x89PNG\r\n\x1a\n" && bytes.find("IEND") != std::string::npos;
}

TEST_F(Program, HelpTeaches) {
  for (const char* command : {"render", "compare", "trace", "pack", "info", "make-scene", "bench", "machines"}) {
    const Outcome help = run({command, "--help"});
    EXPECT_EQ(help.exit_code, 0) << command;
    EXPECT_NE(help.out.find("Examples:\n  "), std::string::npos) << command;
    EXPECT_NE(help.out.find(std::string("retrace ") + command), std::string::npos) << command;
  }
  EXPECT_NE(run({"--help"}).out.find("Start here"), std::string::npos);
  EXPECT_EQ(run({"--version"}).out.find("retrace "), 0u);
}

TEST_F(Program, WrongUsageIsOneLineAndTwo) {
  const std::vector<Arguments> cases = {
      {},
      {"frobnicate"},
      {"render"},
      {"render", "box"},
      {"render", "box", "-o", "a.png", "--size", "0x4"},
      {"render", "box", "-o", "a.png", "--size", "20000x4"},
      {"render", "box", "-o", "a.png", "--size", "4"},
      {"render", "box", "-o", "a.png", "--size", "4x4x4"},
      {"render", "box", "-o", "a.png", "--spp", "0"},
      {"render", "box", "-o", "a.png", "--spp", "many"},
      {"render", "box", "-o", "a.png", "--engine", "warp"},
      {"render", "box", "-o", "a.png", "--engine", "golden:7"},
      {"render", "box", "-o", "a.png", "--aov", "depth,nonsense"},
      {"render", "box", "-o", "a.png", "--exposure", "bright"},
      {"render", "box", "-o", "a.png", "--exposure", "nan"},
      {"render", "box", "-o", "a.png", "--ao", "1", "--ao-distance", "nan"},
      {"render", "box", "-o", "a.png", "--ao", "1", "--ao-distance", "inf"},
      {"render", "box", "-o", "a.png", "--ao", "1", "--ao-distance", "0"},
      {"render", "box", "-o", "a.png", "--animation", "--fps", "nan"},
      {"render", "box", "-o", "a.png", "--animation", "--fps", "1001"},
      {"render", "box", "-o", "a.png", "--animation", "--start", "nan"},
      {"render", "box", "-o", "a.png", "--animation", "--start", "-1"},
      {"render", "box", "-o", "a.png", "--way-up", "sideways"},
      {"render", "box", "-o", "a.png", "--way-up", "stack", "--engine", "csim"},
      {"render", "box", "-o", "a.png", "--mailbox=-1"},
      {"render", "box", "-o", "a.png", "--mailbox=65"},
      {"render", "box", "-o", "a.png", "--mailbox=8.5"},
      {"trace", "box", "-i", "rays.npy", "-o", "a", "--mailbox=many"},
      {"render", "box", "-o", "a.png", "--nonsense"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--config", "huge"},
      {"render", "box", "-o", "a.png", "--engine", "rtl:huge"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--memory", "40"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--memory", "latency=0"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--memory", "latency=9-3"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--memory", "latency=99999999999999"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--memory", "bytes=nan"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--memory", "bytes=8,"},
      {"render", "box", "-o", "a.png", "--engine", "rtl", "--aov", "steps"},
      {"compare", "box", "--engines", "csim,rtl:huge"},
      {"bench", "box", "--engine", "rtl", "--memory", "bytes=-1"},
      {"machines", "box", "--machines", "golden"},
      {"machines", "box", "--machines", ""},
      {"machines", "box", "--size", "0x4"},
      {"machines", "box", "--json", "a.json", "--page", "./a.json"},
      {"machines", "box", "--memory", "latency=60"},
      {"compare", "box", "--engines", "golden"},
      {"compare", "box", "--engines", "golden,csim,golden"},
      {"compare", "box", "--engines", "golden,,csim"},
      {"compare", "box", "--engines", "golden,csim,gold"},
      {"compare", "box", "--rays", "sound"},
      {"make-scene"},
      {"make-scene", "box"},
      {"trace", "box", "-i", "rays.npy"},
      {"lab"},
      {"lab", "box", "--size", "4"},
      {"lab", "box", "--size", "9999x4"},
      {"lab", "box", "--caches", "3"},
      {"lab", "box", "--only", "nothing"},
      {"pack", "box"}};
  for (const Arguments& arguments : cases) {
    const Outcome outcome = run(arguments);
    const std::string line = arguments.empty() ? "" : arguments.back();
    EXPECT_EQ(outcome.exit_code, 2) << line << ": " << outcome.err;
    EXPECT_EQ(outcome.err.find("retrace: error: "), 0u) << line << ": " << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << line << ": " << outcome.err;
    EXPECT_EQ(outcome.out, "") << line;
  }
  EXPECT_TRUE(files().empty());
}

TEST_F(Program, TheSameFileTwiceIsWrongUsage) {
  ASSERT_EQ(run({"make-scene", "box", "-o", "box.glb"}).exit_code, 0);
  write("rays.npy", "not looked at");
  fs::create_symlink("box.glb", work("link.glb"));
  fs::create_hard_link(work("box.glb"), work("hard.png"));
  const std::string scene = text_of(work("box.glb"));
  const std::vector<Arguments> cases = {{"pack", "box.glb", "-o", "box.glb"},
                                        {"pack", "box.glb", "-o", "link.glb"},
                                        {"pack", "link.glb", "-o", "./box.glb"},
                                        {"render", "box.glb", "-o", "hard.png"},
                                        {"render", "box.glb", "-o", "a.png", "--stats", "box.glb"},
                                        {"render", "box.glb", "-o", "a.png", "--stats", "./a.png"},
                                        {"render", "box.glb", "-o", "a.png", "--aov", "depth,depth"},
                                        {"render", "box.glb", "-o", "a.png", "--aov", "id", "--stats", "a.id.png"},
                                        {"render", "box.glb", "-o", "/dev/stdout", "--aov", "id"},
                                        {"compare", "box.glb", "-o", "a.png", "--stats", "a.png"},
                                        {"compare", "box.glb", "--stats", "box.glb"},
                                        {"trace", "box.glb", "-i", "rays.npy", "-o", "x", "--stats", "x"},
                                        {"trace", "box.glb", "-i", "rays.npy", "-o", "rays.npy"},
                                        {"trace", "box.glb", "-i", "rays.npy", "-o", "x", "--stats", "box.glb"},
                                        {"lab", "box.glb", "--html", "x", "--markdown", "x"},
                                        {"lab", "box.glb", "--html", "box.glb"},
                                        {"lab", "box.glb", "link.glb", "box.glb", "--plots", "."}};
  const auto before = files();
  for (const Arguments& arguments : cases) {
    const Outcome outcome = run(arguments);
    std::string line;
    for (const std::string& a : arguments) line += a + " ";
    EXPECT_EQ(outcome.exit_code, 2) << line << ": " << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << line << ": " << outcome.err;
    EXPECT_EQ(files(), before) << line;
    EXPECT_EQ(text_of(work("box.glb")), scene) << line;
  }
}

TEST_F(Program, StandardOutputMayBeAnOutput) {
  const Outcome picture = run({"render", "box", "-o", "/dev/stdout", "--size", "32x24", "--spp", "1"});
  ASSERT_EQ(picture.exit_code, 0) << picture.err;
  EXPECT_EQ(picture.out.substr(0, 4), "\x89PNG");
  EXPECT_TRUE(picture.out.ends_with(std::string("IEND\xae\x42\x60\x82", 8))) << "something follows the picture";
  EXPECT_NE(picture.err.find("wrote /dev/stdout"), std::string::npos) << "what is printed goes to standard error";
  const Outcome scene = run({"make-scene", "box", "-o", "/dev/fd/1"});
  ASSERT_EQ(scene.exit_code, 0) << scene.err;
  EXPECT_EQ(scene.out.substr(0, 4), "glTF");
}

TEST_F(Program, HdrHoldsLinearRadiance) {
  for (const char* name : {"a.hdr", "a.rgbe"}) {
    const Outcome outcome = run({"render", "box", "-o", name, "--size", "32x24", "--spp", "1"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(text_of(work(name)).substr(0, 2), "#?") << name;
  }
  EXPECT_EQ(text_of(work("a.hdr")), text_of(work("a.rgbe")));
}

TEST_F(Program, WhatCannotBePrintedIsAnError) {
  const int full = ::open("/dev/full", O_WRONLY);
  ASSERT_GE(full, 0);
  for (const Arguments& arguments :
       std::vector<Arguments>{{"info", "box"}, {"--help"}, {"render", "--help"}, {"--version"}}) {
    std::vector<char*> argv = {const_cast<char*>(RETRACE_PROGRAM)};
    for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      ::dup2(full, STDOUT_FILENO);
      ::dup2(::open((folder_ / "logs/err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 1) << arguments.back();
    EXPECT_EQ(text_of(folder_ / "logs/err"), "retrace: error: cannot write to standard output\n") << arguments.back();
  }
  ::close(full);
}

TEST_F(Program, ErrorsAreOneLineAndOne) {
  write("text.glb", "this is no scene\n");
  write("empty.gltf", "");
  write("line\nbreak.gltf", "{");
  write("broken.rtkd", std::string("RTKD") + std::string(300, 'x'));
  write("bad.npy", "nothing");
  const std::vector<Arguments> cases = {{"render", "missing.glb", "-o", "a.png"},
                                        {"render", "text.glb", "-o", "a.png"},
                                        {"render", "empty.gltf", "-o", "a.png"},
                                        {"render", "line\nbreak.gltf", "-o", "a.png"},
                                        {"render", ".", "-o", "a.png"},
                                        {"render", "broken.rtkd", "-o", "a.png"},
                                        {"render", "box", "-o", "no/such/folder/a.png"},
                                        {"render", "box", "-o", "a.nonsense"},
                                        {"render", "box", "-o", "a"},
                                        {"render", "box", "-o", "a.null"},
                                        {"render", "box", "-o", "a.ico", "--size", "640x480"},
                                        {"render", "box", "-o", "/proc/a.png"},
                                        {"render", "box", "-o", "a.png", "--camera", "nobody"},
                                        {"render", "box", "-o", "a.png", "--stats", "no/such/folder/a.json"},
                                        {"render", "box:sides=7", "-o", "a.png"},
                                        {"info", "broken.rtkd"},
                                        {"info", "missing.glb"},
                                        {"pack", "missing.glb", "-o", "a.rtkd"},
                                        {"make-scene", "castle", "-o", "a.glb"},
                                        {"make-scene", "knot", "-o", "a.glb", "--set", "along=-5"},
                                        {"make-scene", "knot", "-o", "a.glb", "--set", "along"},
                                        {"trace", "box", "-i", "bad.npy", "-o", "hits.npy"},
                                        {"trace", "box", "-i", "missing.npy", "-o", "hits.npy"},
                                        {"trace", "box", "-i", ".", "-o", "hits.npy"},
                                        {"bench", "missing.glb"},
                                        {"compare", "missing.glb", "-o", "a.png", "--stats", "a.json"}};
  const auto before = files();
  for (const Arguments& arguments : cases) {
    Arguments quiet = arguments;
    quiet.emplace_back("--quiet");
    const Outcome outcome = run(quiet);
    std::string line;
    for (const std::string& a : arguments) line += a + " ";
    EXPECT_EQ(outcome.exit_code, 1) << line << ": " << outcome.err;
    EXPECT_EQ(outcome.err.find("retrace: error: "), 0u) << line << ": " << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << line << ": " << outcome.err;
    EXPECT_EQ(files(), before) << line;
  }
}

TEST_F(Program, RendersPicturesAovsAndStats) {
  const Outcome outcome = run({"render", "box", "-o", "box.png", "--engine", "golden", "--size", "40x30", "--aov",
                               "depth,steps,id", "--stats", "box.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(files(), (std::vector<std::string>{"box.depth.exr", "box.depth.png", "box.id.exr", "box.id.png", "box.json",
                                               "box.png", "box.steps.exr", "box.steps.png"}));
  for (const std::string& name : files()) {
    EXPECT_TRUE(!name.ends_with(".png") || is_png(text_of(work(name)))) << name;
    EXPECT_NE(outcome.out.find("wrote " + name), std::string::npos) << name;
  }
  const nlohmann::json stats = json("box.json");
  EXPECT_EQ(stats["engine"], "golden");
  EXPECT_EQ(stats["width"], 40);
  EXPECT_EQ(stats["rays"]["camera"]["rays"], 40 * 30 * 4);
  EXPECT_GT(stats["rays"]["camera"]["tests"], 0);
  EXPECT_EQ(stats["files"].size(), files().size() - 1) << "all but the statistics themselves";
}

TEST_F(Program, CsimRendersTheSamePicture) {
  ASSERT_EQ(run({"render", "box", "-o", "a.png", "--engine", "golden", "--size", "32x24", "--spp", "1"}).exit_code, 0);
  ASSERT_EQ(
      run({"render", "box", "-o", "b.png", "--engine", "csim", "--size", "32x24", "--spp", "1", "--mailbox"}).exit_code,
      0);
  EXPECT_TRUE(is_png(text_of(work("b.png"))));
  const auto a = fs::file_size(work("a.png")), b = fs::file_size(work("b.png"));
  EXPECT_NEAR(static_cast<double>(a), static_cast<double>(b), 0.02 * static_cast<double>(a));
}

TEST_F(Program, CompareCountsAndDraws) {
  const Outcome outcome = run({"compare", "knot:along=60,around=12", "--engines", "golden,csim", "--size", "64x48",
                               "-o", "d.png", "--stats", "d.json", "--way-up", "parent", "--mailbox"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_NE(outcome.out.find("\n0 violations\n"), std::string::npos) << outcome.out;
  EXPECT_TRUE(is_png(text_of(work("d.png"))));
  const nlohmann::json stats = json("d.json");
  EXPECT_EQ(stats["violations"], 0);
  for (const char* kind : {"primary", "shadow"}) {
    const auto& rays = stats["pairs"][0][kind];
    EXPECT_EQ(
        rays["same"].get<int>() + rays["edge"].get<int>() + rays["depth"].get<int>() + rays["violation"].get<int>(),
        rays["rays"]);
    EXPECT_GT(rays["both_hit"], 10) << kind;
  }
  EXPECT_EQ(stats["pairs"][0]["primary"]["rays"], 64 * 48);
  EXPECT_EQ(stats["pairs"][0]["bit_for_bit"], false);
}

TEST_F(Program, TwoFixedPointEnginesMustAgreeBitForBit) {
  const Outcome outcome = run({"compare", "knot:along=60,around=12", "--engines", "golden,csim,rtl:small", "--size",
                               "32x24", "-o", "d.png", "--stats", "d.json"});
  if (outcome.err.find("built without engine rtl") != std::string::npos) GTEST_SKIP() << outcome.err;
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("csim against rtl:small"), std::string::npos) << outcome.out;
  EXPECT_TRUE(is_png(text_of(work("d.png"))));
  const nlohmann::json stats = json("d.json");
  ASSERT_EQ(stats["pairs"].size(), 2U);
  EXPECT_EQ(stats["pairs"][0]["engines"], nlohmann::json({"golden", "csim"}));
  EXPECT_EQ(stats["pairs"][0]["bit_for_bit"], false);
  EXPECT_EQ(stats["pairs"][1]["engines"], nlohmann::json({"csim", "rtl:small"}));
  EXPECT_EQ(stats["pairs"][1]["bit_for_bit"], true);
  for (const char* kind : {"primary", "shadow"}) {
    EXPECT_EQ(stats["pairs"][1][kind]["same"], stats["pairs"][1][kind]["rays"]) << kind;
    EXPECT_GT(stats["pairs"][1][kind]["both_hit"], 5) << kind;
  }
}

TEST_F(Program, PackThenInfo) {
  ASSERT_EQ(run({"pack", "knot:along=60,around=12", "-o", "knot.rtkd"}).exit_code, 0);
  EXPECT_EQ(files(), std::vector<std::string>{"knot.rtkd"});
  const Outcome packed = run({"info", "knot.rtkd", "--json"}),
                direct = run({"info", "knot:along=60,around=12", "--json"});
  const auto a = nlohmann::json::parse(packed.out), b = nlohmann::json::parse(direct.out);
  for (const char* key : {"triangles", "nodes", "leaves", "references", "sah_cost", "bytes", "depth_histogram"})
    EXPECT_EQ(a[key], b[key]) << key;
  EXPECT_EQ(a["bytes"], fs::file_size(work("knot.rtkd")));
  EXPECT_EQ(a["triangles"], 1440);
  EXPECT_NE(run({"info", "knot.rtkd"}).out.find("leaves by depth"), std::string::npos);
}

TEST_F(Program, InstancesThroughTheCoreOfTwoLevels) {
  const std::string scene = "carousel:count=12,detail=2";
  const Outcome equal =
      run({"compare", scene, "--two-level", "on", "--engines", "golden,csim,rtl:saarcor", "--size", "32x24", "-q"});
  if (equal.err.find("built without engine rtl") != std::string::npos) GTEST_SKIP() << equal.err;
  EXPECT_EQ(equal.exit_code, 0) << equal.out << equal.err;
  EXPECT_NE(equal.out.find("csim against rtl:saarcor"), std::string::npos) << equal.out;
  const Outcome refused =
      run({"compare", scene, "--two-level", "on", "--engines", "csim,rtl:small", "--size", "32x24", "-q"});
  EXPECT_EQ(refused.exit_code, 1) << refused.out;
  EXPECT_NE(refused.err.find("the configuration 'small' one level"), std::string::npos) << refused.err;
}

TEST_F(Program, InstancesStayInstances) {
  const std::string scene = "carousel:count=12,detail=2";
  const Outcome pack = run({"pack", scene, "--two-level", "auto", "-o", "a.rtkd", "-q"});
  EXPECT_EQ(pack.exit_code, 0) << pack.err;
  EXPECT_NE(pack.out.find("two levels: 13 instances of 4 objects"), std::string::npos) << pack.out;
  const auto info = nlohmann::json::parse(run({"info", "a.rtkd", "--json"}).out);
  EXPECT_EQ(info["version"], 3);
  EXPECT_EQ(info["instances"], 13);
  EXPECT_EQ(info["objects"], 4);
  EXPECT_GT(info["instanced_triangles"], info["triangles"]);
  for (const char* engine : {"golden", "csim"}) {
    const Outcome render =
        run({"render", scene, "--two-level", "on", "--engine", engine, "-o", std::string(engine) + ".png", "--size",
             "48x36", "--spp", "1", "--aov", "id", "--stats", "stats.json", "-q"});
    EXPECT_EQ(render.exit_code, 0) << render.err;
    EXPECT_EQ(json("stats.json")["scene"]["instances"], 13);
  }
  // The picture of ids shows the same triangles.
  EXPECT_EQ(text_of(work("golden.id.png")), text_of(work("csim.id.png")));
  const Outcome compare = run({"compare", scene, "--two-level", "on", "--size", "64x48", "-q"});
  EXPECT_EQ(compare.exit_code, 0) << compare.out << compare.err;
  EXPECT_NE(compare.out.find("0 violations"), std::string::npos);
  // One level unless asked for, and by auto where nothing is shown twice.
  EXPECT_EQ(nlohmann::json::parse(run({"info", scene, "--json", "-q"}).out)["version"], 2);
  EXPECT_EQ(nlohmann::json::parse(run({"info", "one", "--two-level", "auto", "--json", "-q"}).out)["version"], 2);
  EXPECT_EQ(run({"render", scene, "--two-level", "maybe", "-o", "x.png"}).exit_code, 2);
}

TEST_F(Program, MakeSceneWritesWhatRenderReads) {
  ASSERT_EQ(run({"make-scene", "knot", "-o", "knot.glb", "--set", "along=40", "--set", "around=8"}).exit_code, 0);
  const Outcome made = run({"info", "knot.glb", "--json"});
  EXPECT_EQ(nlohmann::json::parse(made.out)["triangles"], 640);
  const Outcome list = run({"make-scene", "--list"});
  for (const char* name : {"box", "room", "knot", "sphere", "needles", "none"})
    EXPECT_NE(list.out.find(name), std::string::npos) << name;
}

TEST_F(Program, BenchHasTheKeysThatScriptsRead) {
  const Outcome outcome =
      run({"bench", "--json", "knot:along=60,around=12", "box", "--size", "32x24", "--repeat", "1"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json["scenes"].size(), 2u);
  for (const auto& scene : json["scenes"]) {
    for (const char* key :
         {"name", "triangles", "build_s", "image_bytes", "golden_rays_s", "csim_rays_s", "embree_rays_s", "per_ray"}) {
      EXPECT_TRUE(scene.contains(key)) << key;
    }
    for (const char* way : {"stack", "parent", "face"}) {
      for (const char* key : {"down", "up", "leaf", "tests", "tests_mailbox"})
        EXPECT_TRUE(scene["per_ray"][way][key].is_number()) << way << key;
    }
    EXPECT_EQ(scene["per_ray"]["stack"]["tests"], scene["per_ray"]["face"]["tests"]);
    EXPECT_GT(scene["per_ray"]["parent"]["up"], 0);
    EXPECT_LE(scene["per_ray"]["face"]["tests_mailbox"], scene["per_ray"]["face"]["tests"]);
  }
  EXPECT_EQ(json["scenes"][0]["triangles"], 1440);
}

// ---------------------------------------------------------------------------------------------- trace

std::string rays_file(const std::vector<NpyRay>& rays) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (" + std::to_string(rays.size()) + ", 8), }";
  header.append(118 - header.size() - 1, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\0", 8);
  bytes += static_cast<char>(header.size());
  bytes += '\0';
  bytes += header;
  bytes.append(reinterpret_cast<const char*>(rays.data()), rays.size() * sizeof(NpyRay));
  return bytes;
}

std::vector<SceneHit> hits_of(const std::string& bytes) {
  const std::size_t start =
      10 + (static_cast<unsigned char>(bytes[8]) | static_cast<std::size_t>(static_cast<unsigned char>(bytes[9])) << 8);
  std::vector<SceneHit> hits((bytes.size() - start) / sizeof(SceneHit));
  std::memcpy(hits.data(), bytes.data() + start, hits.size() * sizeof(SceneHit));
  return hits;
}

/// A glTF file of two meshes and three nodes; node 2 shows mesh 1 moved by (10, 0, 0), node 1 shows it in place, node 0 shows mesh 0.
/// Mesh 1 has two primitives, the second of which holds two triangles with the vertices (0,0,0), (4,0,0), (0,2,0) in rotated order.
std::string instanced_gltf() {
  return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
"nodes": [{"mesh": 0, "translation": [0, 0, -5]}, {"mesh": 1}, {"mesh": 1, "translation": [10, 0, 0]}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]},
           {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}, {"attributes": {"POSITION": 0}, "indices": 2}]}],
"buffers": [{"byteLength": 54, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAQAAAAAAAAAAAAAAAAAAAAEAAAAAAAQACAAAAAgAAAAEAAAABAAIA"}],
"bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}, {"buffer": 0, "byteOffset": 42, "byteLength": 12}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [4, 2, 0]},
              {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
              {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}]})";
}

/// The machines see the same rays, so they find as many hits, and each says what its clocks went into.
TEST_F(Program, MachinesOnTheSameRays) {
  const Outcome outcome = run({"machines", "knot:along=60,around=8", "box", "--size", "24x18", "--machines",
                               "stream,stream:branching,packets", "--json", "m.json", "--page", "m.md", "--quiet"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json result = json("m.json");
  const std::string page = text_of(work("m.md"));
  ASSERT_EQ(result["scenes"].size(), 2u);
  for (const nlohmann::json& scene : result["scenes"]) {
    const nlohmann::json& rows = scene["machines"];
    ASSERT_EQ(rows.size(), 3u);
    for (const nlohmann::json& row : rows) {
      EXPECT_EQ(row["rays"], rows[0]["rays"]);
      // Rays at edges may differ between the grid and the kd-tree.
      EXPECT_NEAR(row["hits"].get<double>(), rows[0]["hits"].get<double>(), 1) << row;
      EXPECT_GT(row["hits"], 0);
      for (const char* key : {"clocks_per_ray", "bytes_per_ray", "steps_per_ray", "tests_per_ray"})
        EXPECT_GT(row[key], 0) << row;
      double busiest = 0;
      for (const auto& [unit, share] : row["busy"].items()) {
        EXPECT_LE(share, 1) << row;
        busiest = std::max(busiest, share.get<double>());
      }
      EXPECT_GT(busiest, 0.05) << row;
      EXPECT_NE(page.find("| " + scene["name"].get<std::string>() + " | " + row["machine"].get<std::string>() + " |"),
                std::string::npos);
    }
    // Multi-pass and branching do the same work; what differs is that states travel.
    EXPECT_EQ(rows[0]["tests_per_ray"], rows[1]["tests_per_ray"]);
    EXPECT_EQ(rows[0]["steps_per_ray"], rows[1]["steps_per_ray"]);
    EXPECT_GT(rows[0]["bytes_per_ray"], rows[1]["bytes_per_ray"]);
  }
  EXPECT_EQ(run({"machines", "box", "nonsense", "--json", "n.json", "--quiet"}).exit_code, 1);
  EXPECT_EQ(files(), (std::vector<std::string>{"m.json", "m.md"}));
}

TEST_F(Program, TraceReportsIndicesAndBarycentricsOfTheFile) {
  write("scene.gltf", instanced_gltf());
  const double inf = INFINITY;
  write("rays.npy", rays_file({
                        {1, 0.5, 7, 0, 0, 0, -1, inf},     // the instance in place
                        {11, 0.5, 7, 0, 0, 0, -2, inf},    // the moved one, t in lengths of the direction
                        {1, 0.5, -3, 0, 0, 0, -0.5, inf},  // mesh 0, behind
                        {3.9, 1.9, 7, 0, 0, 0, -1, inf},   // beside all
                        {1, 0.5, 7, 8, 0, 0, -1, inf},     // t_min behind the first: the second
                        {1, 0.5, 7, 0, 0, 0, -1, 6.5},     // t_max in front
                        {1e6, 0, 0, 0, 0, 1, 0, inf},      // far away
                    }));
  for (const char* engine : {"golden", "csim"}) {
    const Outcome outcome = run({"trace", "scene.gltf", "-i", "rays.npy", "-o", "hits.npy", "--engine", engine});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::vector<SceneHit> hits = hits_of(text_of(work("hits.npy")));
    ASSERT_EQ(hits.size(), 7u);
    // Coincident triangles: the lowest id wins, which is primitive 0 with the order 1, 2, 0.
    EXPECT_NEAR(hits[0].t, 7, 1e-5);
    EXPECT_EQ(hits[0].mesh, 1);
    EXPECT_EQ(hits[0].primitive, 0);
    EXPECT_EQ(hits[0].triangle, 0);
    EXPECT_EQ(hits[0].node, 1);
    EXPECT_NEAR(hits[0].u, 0.25, 1e-5);  // second vertex as listed: (0, 2, 0), y / 2
    EXPECT_NEAR(hits[0].v, 0.5, 1e-5);   // third: (0, 0, 0)
    EXPECT_NEAR(hits[1].t, 3.5, 1e-5);
    EXPECT_EQ(hits[1].node, 2);
    EXPECT_EQ(hits[1].mesh, 1);
    EXPECT_NEAR(hits[2].t, 4, 1e-5);
    EXPECT_EQ(hits[2].node, 0);
    EXPECT_EQ(hits[2].mesh, 0);
    EXPECT_NEAR(hits[2].u, 0.25, 1e-5);  // (4, 0, 0), x / 4
    EXPECT_NEAR(hits[2].v, 0.25, 1e-5);  // (0, 2, 0)
    for (const std::size_t miss : {std::size_t{3}, std::size_t{5}, std::size_t{6}}) {
      EXPECT_EQ(hits[miss].t, inf) << miss;
      EXPECT_EQ(hits[miss].mesh, -1) << miss;
      EXPECT_EQ(hits[miss].primitive, -1) << miss;
      EXPECT_EQ(hits[miss].triangle, -1) << miss;
      EXPECT_EQ(hits[miss].node, -1) << miss;
    }
    EXPECT_NEAR(hits[4].t, 12, 1e-5);
    EXPECT_EQ(hits[4].node, 0);

    ASSERT_EQ(run({"trace", "scene.gltf", "-i", "rays.npy", "-o", "any.npy", "--engine", engine, "--any"}).exit_code,
              0);
    const std::vector<SceneHit> any = hits_of(text_of(work("any.npy")));
    for (std::size_t i = 0; i < hits.size(); ++i) EXPECT_EQ(std::isinf(any[i].t), std::isinf(hits[i].t)) << i;
  }
}

TEST_F(Program, TraceNamesTheRayThatIsWrong) {
  write("rays.npy", rays_file({{0, 0, 0, 0, 0, 0, 1, 1}, {0, 0, 0, 0, 0, 0, 0, 1}}));
  const Outcome zero = run({"trace", "box", "-i", "rays.npy", "-o", "hits.npy"});
  EXPECT_EQ(zero.exit_code, 1);
  EXPECT_NE(zero.err.find("ray 1"), std::string::npos) << zero.err;
  write("rays.npy", rays_file({{NAN, 0, 0, 0, 0, 0, 1, 1}}));
  EXPECT_EQ(run({"trace", "box", "-i", "rays.npy", "-o", "hits.npy"}).exit_code, 1);
  write("rays.npy", rays_file({}));
  EXPECT_EQ(run({"trace", "box", "-i", "rays.npy", "-o", "hits.npy"}).exit_code, 0);
  EXPECT_EQ(hits_of(text_of(work("hits.npy"))).size(), 0u);
}

// ---------------------------------------------------------------------------------------------- interruption

TEST_F(Program, InterruptionLeavesNothing) {
  write("a.png", "old");
  const pid_t child = start({"render", "box", "-o", "a.png", "--size", "4000x4000", "--spp", "1024", "--aov", "depth"});
  // Once it handles the signal it is at work, and a render of this size takes minutes.
  const auto handles = [&](int signal) {
    const std::string status = text_of("/proc/" + std::to_string(child) + "/status");
    const std::size_t at = status.find("SigCgt:");
    return at != std::string::npos && (std::stoull(status.substr(at + 7), nullptr, 16) >> (signal - 1) & 1) != 0;
  };
  while (!handles(SIGINT)) ::usleep(1000);
  ::usleep(300000);
  ::kill(child, SIGINT);
  const Outcome outcome = finish(child);
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT);
  EXPECT_EQ(files(), std::vector<std::string>{"a.png"});
  EXPECT_EQ(text_of(work("a.png")), "old");
}

/// What a scene is made of is an input too, whatever the name it goes by: its texture and buffer are never replaced by a picture.
TEST_F(Program, FilesThatASceneNamesAreNotWritten) {
  fs::create_directories(work("maps"));
  const std::string gltf =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)"
      R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}],"textures":[{"source":0}],)"
      R"("images":[{"uri":"maps/wood%20grain.png"},{"uri":"unused.png"}],)"
      R"("buffers":[{"byteLength":36,"uri":"points.exr"}],"bufferViews":[{"buffer":0,"byteLength":36}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}]})";
  const float points[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const auto put = [&](const std::string& name, std::string_view bytes) {
    std::ofstream(work(name), std::ios::binary) << bytes;
  };
  put("scene.gltf", gltf);
  put("points.exr", {reinterpret_cast<const char*>(points), sizeof points});
  ASSERT_EQ(run({"render", "box", "-o", "maps/wood grain.png", "--size", "4x4", "--quiet"}).exit_code, 0);
  put("unused.png", "not looked at");
  fs::create_symlink("maps/wood grain.png", work("link.png"));
  const std::string texture = text_of(work("maps/wood grain.png")), buffer = text_of(work("points.exr"));
  for (const Arguments& arguments :
       {Arguments{"render", "scene.gltf", "-o", "maps/wood grain.png"},
        {"render", "scene.gltf", "-o", "link.png"},
        {"render", "scene.gltf", "-o", "points.exr"},
        {"render", "scene.gltf", "-o", "unused.png"},
        {"render", "scene.gltf", "-o", "new.png", "--stats", "points.exr"},
        {"pack", "scene.gltf", "-o", "points.exr"},
        {"compare", "scene.gltf", "-o", "maps/../maps/wood grain.png", "--engines", "golden,csim"},
        {"explain", "scene.gltf", "--pixel", "1,1", "--size", "4x4", "-o", "points.exr"}}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments[0] << " " << arguments.back() << ": " << outcome.err;
    EXPECT_NE(outcome.err.find("it cannot be written as well"), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(text_of(work("maps/wood grain.png")), texture);
  EXPECT_EQ(text_of(work("points.exr")), buffer);
  EXPECT_EQ(text_of(work("unused.png")), "not looked at");
  EXPECT_FALSE(fs::exists(work("new.png")));
  EXPECT_EQ(run({"render", "scene.gltf", "-o", "new.png", "--size", "8x8", "--quiet"}).exit_code, 0);
}

}  // namespace
}  // namespace retrace::cli
