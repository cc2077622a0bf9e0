// Reads a scene with Coin and prints the seconds that reading took (the library's start left out)
// and the process's peak memory in kB: what `against.rs` holds ivcam against.
//   g++ -O2 coin_read.cpp -o coin_read -lCoin
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoInteraction.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/nodes/SoSeparator.h>
#include <chrono>
#include <cstdio>
#include <sys/resource.h>

int main(int argc, char **argv) {
  if (argc < 2) return 2;
  SoDB::init();
  SoInteraction::init();
  SoReadError::setHandlerCallback([](const SoError *, void *) {}, nullptr);
  const auto start = std::chrono::steady_clock::now();
  SoInput in;
  SoSeparator *scene = in.openFile(argv[1]) ? SoDB::readAll(&in) : nullptr;
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  if (!scene) return 1;
  scene->ref();
  std::printf("%.6f %ld\n", seconds.count(), usage.ru_maxrss);
}
