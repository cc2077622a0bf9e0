#!/bin/sh
# The film of the 1999 paper: 200 frames that pull focus from the telephone to the book and stop there.
# Run it at the top of the repository: scenes/livroom/pull-focus.sh [FILM [OPTION ...]]. FILM is
# pull-focus.mp4, or pull-focus.png (an animated PNG) where there is no ffmpeg; options go to ivcam.
# Stopped, it goes on where it was: frames that are whole are kept. IVCAM names the program, SAMPLES the
# rays a pixel, FRAMES how many, EASE what is even (distance, diopters or travel; linear or smooth).
set -eu
if command -v ffmpeg >/dev/null 2>&1; then
  film=pull-focus.mp4
else
  film=pull-focus.png
  [ $# -gt 0 ] || echo "There is no ffmpeg, so the film is $film, an animated PNG, which web browsers play." \
    "With ffmpeg it would be pull-focus.mp4: a small file that every player knows." >&2
fi
if [ $# -gt 0 ]; then
  film=$1
  shift
fi
"${IVCAM:-target/release/ivcam}" pull-focus scenes/livroom/livroom.iv --camera camera/cam-5.dat \
  --lens double-gauss --efl 60mm --from 1.5m --to 2.25m --frames "${FRAMES:-200}" \
  --ease "${EASE:-diopters smooth}" --samples "${SAMPLES:-16}" -o "$film" "$@"
