#!/bin/sh
# The film of the 1999 paper: 200 frames that pull focus from the telephone to the book and stop there.
# Run it at the top of the repository: scenes/livroom/pull-focus.sh [FILM], default pull-focus.mp4.
# Stopped, it goes on where it was: frames that are whole are kept. IVCAM names the program, SAMPLES the
# rays a pixel, FRAMES how many, EASE what is even (distance, diopters or travel; linear or smooth).
set -eu
film=${1:-pull-focus.mp4}
"${IVCAM:-target/release/ivcam}" pull-focus scenes/livroom/livroom.iv --camera camera/cam-5.dat \
  --lens double-gauss --efl 60mm --from 1.5m --to 2.25m --frames "${FRAMES:-200}" \
  --ease "${EASE:-diopters smooth}" --samples "${SAMPLES:-16}" -o "$film"
