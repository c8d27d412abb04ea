// Runs a fuzz target over its seeds without libFuzzer: each whole, cut at every place, and with every byte
// changed. usage: fuzz_NAME_replay CORPUS_FOLDER
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "fuzz_target.hpp"

namespace {

std::size_t run(const std::vector<std::uint8_t>& seed) {
  // A long seed is sampled, so that its inputs stay at some ten thousand.
  const std::size_t stride = std::max<std::size_t>(1, seed.size() / 2000);
  std::size_t runs = 1;
  LLVMFuzzerTestOneInput(seed.data(), seed.size());
  std::vector<std::uint8_t> changed = seed;
  for (std::size_t at = 0; at < seed.size(); at += stride) {
    LLVMFuzzerTestOneInput(seed.data(), at);
    for (const std::uint8_t flip : {0x01, 0x80, 0xFF}) {
      changed[at] = static_cast<std::uint8_t>(seed[at] ^ flip);
      LLVMFuzzerTestOneInput(changed.data(), changed.size());
    }
    changed[at] = seed[at];
    runs += 4;
  }
  return runs;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || !std::filesystem::is_directory(argv[1])) {
    std::fprintf(stderr, "usage: %s CORPUS_FOLDER\n", argv[0]);
    return 2;
  }
  std::size_t seeds = 0, runs = 0;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) {
    std::ifstream file(entry.path(), std::ios::binary);
    const std::vector<std::uint8_t> seed{std::istreambuf_iterator<char>(file), {}};
    std::printf("%s: %zu bytes\n", entry.path().filename().c_str(), seed.size());
    std::fflush(stdout);
    runs += run(seed);
    ++seeds;
  }
  std::printf("%zu seeds, %zu inputs\n", seeds, runs);
  return seeds == 0 ? 1 : 0;
}
