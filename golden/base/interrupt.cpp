// See interrupt.hpp. What a signal handler reads is in atomics and in memory that is never freed.
#include "golden/base/interrupt.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/random.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <utility>

namespace retrace {

/// A name that the handler may read while `ready`. Slots form a list that only grows; free ones are used again.
struct TemporaryFile::Slot {
  std::atomic<bool> claimed{true}, ready{false};
  char name[PATH_MAX];
  Slot* next = nullptr;
};

namespace {

std::atomic<TemporaryFile::Slot*> slots{nullptr};
std::atomic<int> shields{0}, pending_signal{0};
std::atomic<pid_t> running_child{0};
static_assert(std::atomic<int>::is_always_lock_free && std::atomic<TemporaryFile::Slot*>::is_always_lock_free);

TemporaryFile::Slot* claim_slot() {
  for (TemporaryFile::Slot* slot = slots.load(); slot != nullptr; slot = slot->next) {
    bool expected = false;
    if (slot->claimed.compare_exchange_strong(expected, true)) return slot;
  }
  auto* slot = new TemporaryFile::Slot;
  slot->next = slots.load();
  while (!slots.compare_exchange_weak(slot->next, slot)) {
  }
  return slot;
}

[[noreturn]] void leave(int signal) {
  if (const pid_t child = running_child.load(); child > 0) {
    ::kill(-child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  for (const TemporaryFile::Slot* slot = slots.load(); slot != nullptr; slot = slot->next) {
    if (slot->ready.load()) ::unlink(slot->name);
  }
  ::_exit(128 + signal);
}

extern "C" void on_signal(int signal) {
  if (shields.load() > 0) {
    pending_signal.store(signal);
    return;
  }
  leave(signal);
}

}  // namespace

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  ::sigemptyset(&action.sa_mask);
  // SIGPIPE too: a reader of standard output that goes away must not leave temporary files behind.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) ::sigaction(signal, &action, nullptr);
  }
  ::signal(SIGXFSZ, SIG_IGN);
}

SignalShield::SignalShield() { shields.fetch_add(1); }
SignalShield::~SignalShield() {
  if (shields.fetch_sub(1) == 1 && pending_signal.load() != 0) leave(pending_signal.load());
}

TemporaryFile::TemporaryFile(const std::string& folder) {
  const SignalShield shield;  // the handler knows every file that exists, and no file of somebody else's
  Slot* slot = claim_slot();
  for (int tries = 0; tries < 100; ++tries) {
    std::uint64_t random = 0;
    if (::getrandom(&random, sizeof random, 0) != static_cast<ssize_t>(sizeof random)) break;
    const int length = std::snprintf(slot->name, sizeof slot->name, "%s/.retrace-%016llx.tmp", folder.c_str(),
                                     static_cast<unsigned long long>(random));
    if (length < 0 || static_cast<std::size_t>(length) >= sizeof slot->name) {
      errno = ENAMETOOLONG;
      break;
    }
    // The mode is what the umask, or the folder's default access list, makes of it.
    descriptor_ = ::open(slot->name, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ >= 0 || errno != EEXIST) break;
  }
  if (descriptor_ < 0) {
    slot->claimed.store(false);
    return;
  }
  slot->ready.store(true);
  slot_ = slot;
}

TemporaryFile::~TemporaryFile() {
  const SignalShield shield;
  close();
  if (slot_ == nullptr) return;
  ::unlink(slot_->name);
  slot_->ready.store(false);
  slot_->claimed.store(false);
}

int TemporaryFile::close() { return descriptor_ >= 0 && ::close(std::exchange(descriptor_, -1)) != 0 ? errno : 0; }

int TemporaryFile::rename_to(const std::string& path) {
  const SignalShield shield;
  if (::rename(slot_->name, path.c_str()) != 0) return errno;
  slot_->ready.store(false);
  std::exchange(slot_, nullptr)->claimed.store(false);
  return 0;
}

void set_child(pid_t child) { running_child.store(child); }

}  // namespace retrace
