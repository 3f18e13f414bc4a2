#include "python_reader.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <spdlog/fmt/fmt.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/user_cache.hpp"
#include "bodyschema/core/write_file.hpp"

extern char** environ;

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

/// Python's own variables, as a sourced ROS workspace sets them, would lead it to other packages than ours.
constexpr const char* kOwnPackagesOnly = "-E";
constexpr const char* kComplete = "complete";  // in an environment: what was asked of PyPI when it was made

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

fs::path cache_folder() {
  const auto cache = user_cache_folder();
  if (cache.empty()) {
    throw DeviceError("no folder for Python's packages: neither XDG_CACHE_HOME nor HOME is set to an absolute path");
  }
  return cache / "python";
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// Held by one process at a time, until its end at the latest.
class FileLock {
 public:
  explicit FileLock(const fs::path& file) : descriptor_(open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600)) {
    if (descriptor_ < 0) throw_write_failure(file, errno);
    while (flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~FileLock() { close(descriptor_); }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int descriptor_;
};

void run_step(const std::vector<std::string>& arguments, const std::string& what, const std::string& remedy) {
  PipedProgram program(arguments);
  std::vector<std::uint8_t> unread(4096);
  while (program.read(unread) > 0) {
  }
  if (program.wait() == 0) return;
  throw DeviceError(what + " failed: " + program.complaint() + "; " + remedy);
}

}  // namespace

fs::path import_file(const std::string& name) {
  const fs::path file = data_directory() / "import" / name;
  if (fs::is_regular_file(file)) return file;
  throw FileError(file.string() + ": no such file; expected the installation's (BODYSCHEMA_SHARE names its folder)");
}

fs::path python_for(const std::string& kind, const std::function<void(const std::string&)>& say) {
  if (const std::string given = variable("BODYSCHEMA_PYTHON"); !given.empty()) return given;
  const fs::path wanted_file = import_file(kind + ".txt");
  const std::string wanted = content_of(wanted_file);
  const fs::path folder = cache_folder() / kind, python = folder / "bin" / "python";
  const auto ready = [&] {
    std::error_code error;
    return fs::exists(python, error) && content_of(folder / kComplete) == wanted;
  };
  if (ready()) return python;
  make_folder(folder.parent_path());
  const FileLock lock(folder.parent_path() / (kind + ".lock"));
  if (ready()) return python;
  say(fmt::format("Python packages for this import are set up once, in {}", folder.string()));
  const std::string otherwise = fmt::format(
      "or name an interpreter that has the packages of {}: BODYSCHEMA_PYTHON=/usr/bin/python3", wanted_file.string());
  run_step({"python3", kOwnPackagesOnly, "-m", "venv", "--clear", folder.string()}, "python3 -m venv",
           "install Python 3 with venv (Debian: python3-venv), " + otherwise);
  run_step({python.string(), kOwnPackagesOnly, "-m", "pip", "install", "--quiet", "--disable-pip-version-check",
            "--timeout", "15", "--retries", "2", "-r", wanted_file.string()},
           "pip install -r " + wanted_file.string(), "connect this machine to PyPI once, " + otherwise);
  replace_file(folder / kComplete, wanted);
  return python;
}

PipedProgram::PipedProgram(const std::vector<std::string>& arguments) {
  int ends[2];
  errors_ = std::tmpfile();
  if (errors_ == nullptr || pipe2(ends, O_CLOEXEC) != 0) {
    const int reason = errno;
    if (errors_ != nullptr) std::fclose(errors_);
    throw DeviceError(fmt::format("{}: cannot be started: {}", arguments.front(), std::strerror(reason)));
  }
  fcntl(fileno(errors_), F_SETFD, FD_CLOEXEC);
  output_ = ends[0];
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(errors_), STDERR_FILENO);
  const int failed = posix_spawnp(&pid_, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (failed == 0) return;
  pid_ = -1;
  close(output_);
  std::fclose(errors_);
  throw DeviceError(fmt::format("{}: cannot be started: {}", arguments.front(), std::strerror(failed)));
}

PipedProgram::~PipedProgram() {
  close(output_);
  if (pid_ > 0) kill(pid_, SIGKILL);
  wait();
  std::fclose(errors_);
}

std::size_t PipedProgram::read(std::span<std::uint8_t> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(output_, bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

int PipedProgram::wait() {
  if (pid_ <= 0) return 0;
  int status = 0;
  while (waitpid(pid_, &status, 0) < 0) {
    if (errno != EINTR) return -1;
  }
  pid_ = -1;
  constexpr int kSignalled = 128;
  return WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status);
}

std::string PipedProgram::complaint() const {
  constexpr long kLast = 600;
  std::string text(kLast, '\0');
  std::fseek(errors_, 0, SEEK_END);
  std::fseek(errors_, -std::min(kLast, std::ftell(errors_)), SEEK_END);
  text.resize(std::fread(text.data(), 1, text.size(), errors_));
  std::string line;
  for (const char c : text) {
    const bool blank = c == '\n' || c == '\r' || c == ' ' || c == '\t';
    if (!blank) line += c;
    if (blank && !line.empty() && line.back() != ' ') line += ' ';
  }
  while (!line.empty() && line.back() == ' ') line.pop_back();
  return line.empty() ? "it said nothing" : line;
}

void rethrow_with_complaint(PipedProgram& reader, const std::string& recording, const FileError& error) {
  if (!std::string(error.what()).ends_with(kReaderEnded)) throw error;
  const int status = reader.wait();
  throw FileError(fmt::format("{}: its reader ended with status {}: {}", recording, status, reader.complaint()));
}

}  // namespace bodyschema
