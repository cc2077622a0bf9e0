// Reads a scene with Coin and prints the processor time that reading took in seconds (the library's
// start left out) and the process's peak memory in kB: what `against.rs` holds ivcam against.
//   g++ -O2 coin_read.cpp -o coin_read -lCoin
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoInteraction.h>
#include <Inventor/errors/SoReadError.h>
#include <Inventor/nodes/SoSeparator.h>
#include <cstdio>
#include <ctime>
#include <sys/resource.h>

static double now() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int argc, char **argv) {
  if (argc < 2) return 2;
  SoDB::init();
  SoInteraction::init();
  SoReadError::setHandlerCallback([](const SoError *, void *) {}, nullptr);
  const double start = now();
  SoInput in;
  SoSeparator *scene = in.openFile(argv[1]) ? SoDB::readAll(&in) : nullptr;
  const double seconds = now() - start;
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  if (!scene) return 1;
  scene->ref();
  std::printf("%.6f %ld\n", seconds, usage.ru_maxrss);
}
