// For compilers without libFuzzer: runs every file of a folder through the target, each as it is and
// with random changes. Prints its seed; BODYSCHEMA_SEED repeats a run.
//   fuzz_x FOLDER [CHANGES_PER_FILE]

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "fuzz.hpp"

namespace {

using Input = std::vector<std::uint8_t>;

Input changed(Input input, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % std::max<std::size_t>(1, n)); };
  const std::size_t changes = 1 + below(4);
  for (std::size_t i = 0; i < changes && !input.empty(); ++i) {
    const std::size_t at = below(input.size());
    switch (below(5)) {
      case 0: input[at] ^= static_cast<std::uint8_t>(1u << below(8)); break;
      case 1: input[at] = static_cast<std::uint8_t>(random()); break;
      case 2: input.resize(at); break;
      case 3: {
        const Input piece(input.begin() + static_cast<std::ptrdiff_t>(at),
                          input.begin() + static_cast<std::ptrdiff_t>(std::min(input.size(), at + 1 + below(64))));
        input.insert(input.begin() + static_cast<std::ptrdiff_t>(below(input.size())), piece.begin(), piece.end());
        break;
      }
      case 4:
        std::fill_n(input.begin() + static_cast<std::ptrdiff_t>(at), std::min<std::size_t>(4, input.size() - at),
                    static_cast<std::uint8_t>(below(2) * 255));
        break;
    }
  }
  return input;
}

/// Keeps the input that a decoder let an exception of another kind escape for.
bool survives(const Input& input) {
  try {
    LLVMFuzzerTestOneInput(input.data(), input.size());
    return true;
  } catch (const std::exception& error) {
    const std::string name = "fuzz_finding";
    std::ofstream(name, std::ios::binary)
        .write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
    std::fprintf(stderr, "not an error of this project: %s (input kept in %s)\n", error.what(), name.c_str());
    return false;
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s FOLDER [CHANGES_PER_FILE]\n", argv[0]);
    return 2;
  }
  const char* wish = std::getenv("BODYSCHEMA_SEED");
  const std::uint64_t seed = wish != nullptr ? std::strtoull(wish, nullptr, 10) : std::random_device{}();
  const int changes = argc > 2 ? std::atoi(argv[2]) : 200;
  std::printf("BODYSCHEMA_SEED=%llu\n", static_cast<unsigned long long>(seed));
  std::fflush(stdout);
  std::mt19937_64 random(seed);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    std::fprintf(stderr, "%s: no files\n", argv[1]);
    return 2;
  }
  for (const auto& file : files) {
    std::ifstream stream(file, std::ios::binary);
    const Input input{std::istreambuf_iterator<char>(stream), {}};
    if (!survives(input)) return 1;
    for (int i = 0; i < changes; ++i) {
      if (!survives(changed(input, random))) return 1;
    }
  }
  std::printf("%zu files, %d changes of each\n", files.size(), changes);
}
