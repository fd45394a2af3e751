// Output files: whole or not at all, whatever they are written to.
#include "golden/base/output_file.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <thread>

#include "tests/base/temporary_folder.hpp"

namespace retrace {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public TemporaryFolder {
 protected:
  /// The error of `work`; empty if there is none.
  static std::string error_of(const std::function<void()>& work) {
    try {
      work();
    } catch (const UsageError& error) {
      return std::string("usage: ") + error.what();
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  }
  static mode_t mode_of(const fs::path& path) {
    struct stat info {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0) << path;
    return info.st_mode & 07777;
  }
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST_F(OutputFileTest, NothingIsThereBeforeCommit) {
  const fs::path path = folder_ / "a.txt";
  {
    OutputFile file(path);
    file.write("hello");
    EXPECT_EQ(entries(), 0u);
    file.commit();
    EXPECT_EQ(text_of(path), "hello");
  }
  {
    OutputFile file(path);
    file.write("half");
  }
  EXPECT_EQ(text_of(path), "hello");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(OutputFileTest, ErrorsNameThePathAndTheReason) {
  const auto error = [](const fs::path& path) { return error_of([&] { const OutputFile file(path); }); };
  EXPECT_EQ(error(folder_ / "no" / "a.txt"),
            "cannot write " + (folder_ / "no" / "a.txt").string() + ": No such file or directory");
  EXPECT_TRUE(holds(error(folder_), "it is a folder"));
  EXPECT_TRUE(holds(error(folder_ / ""), "it is a folder"));
  write_file(folder_ / "file", "x");
  EXPECT_TRUE(holds(error(folder_ / "file" / "a.txt"), "Not a directory"));
  EXPECT_TRUE(holds(error(folder_ / std::string(256, 'n')), "File name too long"));
  EXPECT_TRUE(holds(error("/proc/a.txt"), "cannot write /proc/a.txt: "));
  fs::create_symlink("loop", folder_ / "loop");
  EXPECT_TRUE(holds(error(folder_ / "loop"), "symbolic links"));
  EXPECT_EQ(entries(), 2u);
}

TEST_F(OutputFileTest, NamesMayBeAsLongAsTheyMay) {
  write_file(folder_ / std::string(255, 'n'), "long");
  EXPECT_EQ(text_of(folder_ / std::string(255, 'n')), "long");
}

TEST_F(OutputFileTest, LinksAreFollowed) {
  fs::create_directories(folder_ / "there");
  write_file(folder_ / "there" / "file", "old");
  fs::create_symlink("there/file", folder_ / "second");
  fs::create_symlink(folder_ / "second", folder_ / "first");
  fs::create_symlink("there/new", folder_ / "dangling");
  write_file(folder_ / "first", "new");
  write_file(folder_ / "dangling", "made");
  EXPECT_TRUE(fs::is_symlink(folder_ / "first") && fs::is_symlink(folder_ / "second"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "dangling"));
  EXPECT_EQ(text_of(folder_ / "there" / "file"), "new");
  EXPECT_EQ(text_of(folder_ / "there" / "new"), "made");
  EXPECT_EQ(entries(), 4u);
}

TEST_F(OutputFileTest, OtherNamesOfAFileKeepTheOldContents) {
  write_file(folder_ / "a", "old");
  fs::create_hard_link(folder_ / "a", folder_ / "snapshot");
  write_file(folder_ / "a", "new");
  EXPECT_EQ(text_of(folder_ / "a"), "new");
  EXPECT_EQ(text_of(folder_ / "snapshot"), "old");
}

TEST_F(OutputFileTest, TheModeIsTheOldFilesOrTheUmasks) {
  const mode_t before = ::umask(027);
  write_file(folder_ / "a", "1");
  EXPECT_EQ(mode_of(folder_ / "a"), 0640u);
  ASSERT_EQ(::chmod((folder_ / "a").c_str(), 0604), 0);
  write_file(folder_ / "a", "2");
  EXPECT_EQ(mode_of(folder_ / "a"), 0604u);
  ::umask(before);
}

TEST_F(OutputFileTest, AFifoIsWrittenThrough) {
  const fs::path path = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  OutputFile file(path);  // does not wait for a reader
  std::string read;
  std::thread reader([&] { read = text_of(path); });
  const std::string sent(300000, 'x');
  file.write(sent);
  file.commit();
  reader.join();
  EXPECT_EQ(read, sent);
  EXPECT_TRUE(fs::is_fifo(path));
  EXPECT_EQ(entries(), 1u);
}

TEST_F(OutputFileTest, DevicesAreWrittenThrough) {
  write_file("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  fs::create_symlink("/dev/full", folder_ / "link");
  EXPECT_EQ(error_of([&] { write_file(folder_ / "link", "lost"); }),
            "cannot write " + (folder_ / "link").string() + ": No space left on device");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
}

TEST_F(OutputFileTest, DescriptorsAreWrittenThrough) {
  int channel[2];
  ASSERT_EQ(::pipe(channel), 0);
  write_file("/dev/fd/" + std::to_string(channel[1]), "through");
  char buffer[16] = {};
  EXPECT_EQ(::read(channel[0], buffer, sizeof buffer), 7);
  EXPECT_STREQ(buffer, "through");
  // The reading end is no output, and a reader that has gone is an error and no signal.
  EXPECT_TRUE(holds(error_of([&] { write_file("/proc/self/fd/" + std::to_string(channel[0]), "x"); }), "Bad file"));
  ::close(channel[0]);
  EXPECT_TRUE(holds(error_of([&] { write_file("/dev/fd/" + std::to_string(channel[1]), "x"); }), "Broken pipe"));
  ::close(channel[1]);
  // A file that a shell has opened to append to.
  const fs::path log = folder_ / "log";
  write_file(log, "first ");
  const int file = ::open(log.c_str(), O_WRONLY | O_APPEND);
  ASSERT_GE(file, 0);
  write_file("/dev/fd/" + std::to_string(file), "second");
  ::close(file);
  EXPECT_EQ(text_of(log), "first second");
}

TEST_F(OutputFileTest, TextKeepsOutOfStandardOutputThatIsAnOutput) {
  const fs::path out = folder_ / "out", err = folder_ / "err";
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
    OutputFile file("/dev/stdout");
    file.write("bytes");
    std::printf("text");
    file.commit();
    std::printf(" and more");
    std::fflush(stdout);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(text_of(out), "bytes");
  EXPECT_EQ(text_of(err), "text and more");
}

TEST_F(OutputFileTest, ALimitOnTheSizeOfFilesKeepsTheOldOne) {
  const fs::path path = folder_ / "a";
  write_file(path, "old");
  rlimit old;
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old), 0);
  const rlimit little{1000, old.rlim_max};
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  const std::string why = error_of([&] { write_file(path, std::string(1001, 'x')); });
  const std::string none = error_of([&] { write_file(folder_ / "b", std::string(1000, 'x')); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old), 0);
  ::signal(SIGXFSZ, handler);
  EXPECT_EQ(why, "cannot write " + path.string() + ": File too large");
  EXPECT_EQ(none, "");
  EXPECT_EQ(text_of(path), "old");
  EXPECT_EQ(entries(), 2u);
}

TEST_F(OutputFileTest, AllOfACommandsFilesOrNone) {
  write_file(folder_ / "a", "old");
  {
    OutputFiles files;
    files.add(folder_ / "a").write("new");
    files.add(folder_ / "b").write("new");
    files.add("/dev/full").write("lost");
    EXPECT_TRUE(holds(error_of([&] { files.commit(); }), "/dev/full: No space"));
  }
  EXPECT_EQ(text_of(folder_ / "a"), "old");
  EXPECT_EQ(entries(), 1u);
  OutputFiles files;
  files.add(folder_ / "a").write("new");
  files.add(folder_ / "b").write("new");
  files.commit();
  EXPECT_EQ(text_of(folder_ / "a") + text_of(folder_ / "b"), "newnew");
}

TEST_F(OutputFileTest, TheSameFileTwiceIsWrongUsage) {
  fs::create_directories(folder_ / "real");
  fs::create_directory_symlink("real", folder_ / "folder");
  write_file(folder_ / "a", "old");
  fs::create_symlink("a", folder_ / "link");
  fs::create_hard_link(folder_ / "a", folder_ / "hard");
  fs::create_symlink("real/none", folder_ / "dangling");
  const auto twice = [&](const fs::path& first, const fs::path& second) {
    OutputFiles files;
    files.add(folder_ / first);
    return error_of([&] { files.add(folder_ / second); });
  };
  const std::pair<const char*, const char*> same[] = {{"a", "a"},
                                                      {"a", "./a"},
                                                      {"a", "real/../a"},
                                                      {"a", "link"},
                                                      {"a", "hard"},
                                                      {"none", "none"},
                                                      {"none", "./none"},
                                                      {"real/none", "folder/none"},
                                                      {"dangling", "real/none"}};
  for (const auto& [first, second] : same) {
    EXPECT_TRUE(holds(twice(first, second), "usage: ")) << first << ", " << second;
    EXPECT_TRUE(holds(twice(first, second), "twice")) << first << ", " << second;
  }
  EXPECT_EQ(twice("a", "none"), "");
  EXPECT_EQ(twice("real/none", "none"), "");

  OutputFiles files;
  files.reads(folder_ / "a");
  files.reads(folder_ / "missing");  // the name of a generated scene, say
  EXPECT_TRUE(holds(error_of([&] { files.add(folder_ / "link"); }), "usage: "));
  EXPECT_EQ(error_of([&] { files.add(folder_ / "missing"); }), "");
  files.add("/dev/null");
  EXPECT_EQ(error_of([&] { files.add("/dev/null"); }), "");
  EXPECT_EQ(text_of(folder_ / "a"), "old");
}

TEST_F(OutputFileTest, SignalsRemoveTemporaryFiles) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const pid_t child = ::fork();
    if (child == 0) {
      install_signal_handlers();
      const TemporaryFile a(folder_.string()), b(folder_.string());
      if (a.descriptor() < 0 || b.descriptor() < 0 || entries() != 2) ::_exit(1);
      {
        const SignalShield shield;
        ::raise(signal);
        if (entries() != 2) ::_exit(2);
      }
      ::_exit(3);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 128 + signal);
    EXPECT_EQ(entries(), 0u);
  }
}

}  // namespace
}  // namespace retrace
