// SPDX-License-Identifier: GPL-3.0-or-later
#include "problems/io/volumes/confinement.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace semblance::problems {
namespace {

namespace fs = std::filesystem;

// ---------------------------------------------------------------------------------------------
// Landlock. Its numbers stand here because the headers of Debian 12 are older than the kernel's.
// ---------------------------------------------------------------------------------------------

constexpr long kCreateRuleset = 444, kAddRule = 445, kRestrictSelf = 446;  // on all processors
constexpr std::uint64_t kReadFile = 1 << 2, kReadFolder = 1 << 3;

struct LandlockRights {
  std::uint64_t files = 0, net = 0, scopes = 0;
};

struct [[gnu::packed]] LandlockPath {
  std::uint64_t allowed = 0;
  std::int32_t descriptor = -1;
};

long LandlockVersion() {
  constexpr unsigned kAskVersion = 1;
  return ::syscall(kCreateRuleset, nullptr, 0, kAskVersion);
}

// All rights that this version of the kernel can take away.
LandlockRights AllRights(long version) {
  const int file_rights = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  return {.files = (std::uint64_t{1} << file_rights) - 1,
          .net = version >= 4 ? std::uint64_t{3} : 0,
          .scopes = version >= 6 ? std::uint64_t{3} : 0};
}

void AllowReading(int ruleset, const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_PATH | O_CLOEXEC);
  struct stat status {};
  if (descriptor >= 0 && ::fstat(descriptor, &status) == 0) {
    const LandlockPath rule{.allowed = kReadFile | (S_ISDIR(status.st_mode) ? kReadFolder : 0),
                            .descriptor = descriptor};
    constexpr int kPathBeneath = 1;
    ::syscall(kAddRule, ruleset, kPathBeneath, &rule, 0);
  }
  ::close(descriptor);
}

void ConfineFiles(std::span<const fs::path> readable) {
  const long version = LandlockVersion();
  if (version < 1) {
    return;
  }
  const LandlockRights rights = AllRights(version);
  const std::size_t size = version >= 6 ? 24 : version >= 4 ? 16 : 8;
  const auto ruleset = static_cast<int>(::syscall(kCreateRuleset, &rights, size, 0));
  if (ruleset < 0) {
    return;
  }
  for (const char* system : {"/usr", "/lib", "/lib64", "/etc/ld.so.cache", "/dev/null"}) {
    AllowReading(ruleset, system);
  }
  for (const fs::path& path : readable) {
    AllowReading(ruleset, path);
  }
  ::syscall(kRestrictSelf, ruleset, 0);
  ::close(ruleset);
}

// ---------------------------------------------------------------------------------------------
// seccomp
// ---------------------------------------------------------------------------------------------

#if defined(__x86_64__)
constexpr std::uint32_t kProcessor = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kProcessor = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kProcessor = 0;  // no filter
#endif

constexpr std::array kAllowed = {
    // open files
    SYS_read,
    SYS_readv,
    SYS_pread64,
    SYS_write,
    SYS_writev,
    SYS_lseek,
    SYS_close,
    SYS_fstat,
    SYS_newfstatat,
    SYS_statx,
    SYS_faccessat,
    SYS_faccessat2,
    SYS_readlinkat,
    SYS_getdents64,
    SYS_getcwd,
    SYS_fcntl,
    SYS_dup,
    SYS_fadvise64,
    SYS_ppoll,
    // memory
    SYS_mmap,
    SYS_munmap,
    SYS_mprotect,
    SYS_mremap,
    SYS_madvise,
    SYS_brk,
    // threads and signals
    SYS_futex,
    SYS_sched_yield,
    SYS_sched_getaffinity,
    SYS_set_robust_list,
    SYS_rseq,
    SYS_set_tid_address,
    SYS_exit,
    SYS_exit_group,
    SYS_rt_sigaction,
    SYS_rt_sigprocmask,
    SYS_rt_sigreturn,
    SYS_rt_sigsuspend,
    SYS_sigaltstack,
    SYS_restart_syscall,
    // who and when
    SYS_gettid,
    SYS_getpid,
    SYS_getuid,
    SYS_geteuid,
    SYS_getgid,
    SYS_getegid,
    SYS_clock_gettime,
    SYS_clock_getres,
    SYS_gettimeofday,
    SYS_nanosleep,
    SYS_clock_nanosleep,
    SYS_getrusage,
    SYS_sysinfo,
    SYS_uname,
    SYS_getrandom,
#ifdef SYS_open  // calls that newer processors lack
    SYS_stat,
    SYS_lstat,
    SYS_access,
    SYS_readlink,
    SYS_poll,
    SYS_dup2,
    SYS_time,
    SYS_pause,
#endif
};

// A filter is a small program over the number and the arguments of a system call.
class CallFilter {
 public:
  CallFilter() {
    Load(offsetof(seccomp_data, arch));
    program_.push_back(Jump(BPF_JEQ, kProcessor, 1, 0));
    Return(SECCOMP_RET_KILL_PROCESS);
    Load(offsetof(seccomp_data, nr));
  }

  void Allow(long call) {
    program_.push_back(Jump(BPF_JEQ, static_cast<std::uint32_t>(call), 0, 1));
    Return(SECCOMP_RET_ALLOW);
  }

  // Allows the call if `test` (BPF_JSET or BPF_JEQ) of an argument's lower half with `value` gives
  // `wanted`, else it fails with `error`.
  void AllowIf(long call, int argument, std::uint16_t test, std::uint32_t value, bool wanted,
               int error) {
    program_.push_back(Jump(BPF_JEQ, static_cast<std::uint32_t>(call), 0, 4));
    Load(offsetof(seccomp_data, args) + 8 * static_cast<std::size_t>(argument));  // little endian
    program_.push_back(Jump(test, value, wanted ? 0 : 1, wanted ? 1 : 0));
    Return(SECCOMP_RET_ALLOW);
    Fail(error);
  }

  void Fail(int error) { Return(SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error)); }

  void Install() {
    const sock_fprog program{.len = static_cast<unsigned short>(program_.size()),
                             .filter = program_.data()};
    ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program);
  }

 private:
  static sock_filter Jump(std::uint16_t test, std::uint32_t value, int if_true, int if_false) {
    return {static_cast<std::uint16_t>(BPF_JMP | test | BPF_K), static_cast<std::uint8_t>(if_true),
            static_cast<std::uint8_t>(if_false), value};
  }
  void Load(std::size_t offset) {
    program_.push_back({BPF_LD | BPF_W | BPF_ABS, 0, 0, static_cast<std::uint32_t>(offset)});
  }
  void Return(std::uint32_t value) { program_.push_back({BPF_RET | BPF_K, 0, 0, value}); }

  std::vector<sock_filter> program_;
};

void ConfineCalls() {
  if (kProcessor == 0) {
    return;
  }
  constexpr std::uint32_t kWrites = O_ACCMODE | O_CREAT | O_TRUNC | O_APPEND;
  CallFilter filter;
  for (const long call : kAllowed) {
    filter.Allow(call);
  }
  filter.AllowIf(SYS_openat, 2, BPF_JSET, kWrites, /*wanted=*/false, EACCES);
#ifdef SYS_open
  filter.AllowIf(SYS_open, 1, BPF_JSET, kWrites, /*wanted=*/false, EACCES);
#endif
  filter.AllowIf(SYS_clone, 0, BPF_JSET, CLONE_THREAD, /*wanted=*/true, EPERM);
  filter.AllowIf(SYS_tgkill, 0, BPF_JEQ, static_cast<std::uint32_t>(::getpid()), /*wanted=*/true,
                 EPERM);
  filter.AllowIf(SYS_prlimit64, 0, BPF_JEQ, 0, /*wanted=*/true, EPERM);
  // Not EPERM: the C library takes ENOSYS for an older kernel, and uses calls of the list above.
  filter.Fail(ENOSYS);
  filter.Install();
}

}  // namespace

Confinement FindConfinement() {
  return {.files = LandlockVersion() >= 1,
          .calls = kProcessor != 0 && ::prctl(PR_GET_SECCOMP) >= 0};
}

void Confine(std::span<const fs::path> readable) {
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  ConfineFiles(readable);
  ConfineCalls();
}

}  // namespace semblance::problems
