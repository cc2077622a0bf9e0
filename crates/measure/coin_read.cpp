// Reads a scene with Coin repeatedly for a tenth of a second of processor time, and prints the
// seconds per reading (without the start of the library) and the peak memory of the process in kB
// after the first reading. `against.rs` measures ivcam in the same way and compares the two.
//   g++ -O2 coin_read.cpp -o coin_read -lCoin
//   coin_read SCENE                    reads as above
//   coin_read SCENE OUTPUT [binary]    reads once and writes, to be timed as a process
#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/SoInteraction.h>
#include <Inventor/SoOutput.h>
#include <Inventor/actions/SoWriteAction.h>
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

static bool read(const char *file, SoOutput *out = nullptr) {
  SoInput in;
  SoSeparator *scene = in.openFile(file) ? SoDB::readAll(&in) : nullptr;
  if (!scene) return false;
  scene->ref();
  if (out) SoWriteAction(out).apply(scene);
  scene->unref();
  return true;
}

static bool convert(const char *file, const char *output, bool binary) {
  SoOutput out;
  if (!out.openFile(output)) return false;
  out.setBinary(binary);
  return read(file, &out);
}

int main(int argc, char **argv) {
  if (argc < 2) return 2;
  SoDB::init();
  SoInteraction::init();
  SoReadError::setHandlerCallback([](const SoError *, void *) {}, nullptr);
  if (argc > 2) return convert(argv[1], argv[2], argc > 3) ? 0 : 1;
  if (!read(argv[1])) return 1;
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  const double start = now();
  int readings = 0;
  while (now() - start < 0.1) readings += read(argv[1]);
  std::printf("%.7f %ld\n", (now() - start) / readings, usage.ru_maxrss);
}
