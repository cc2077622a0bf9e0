#!/bin/sh
# Renders the figures of the 1999 paper that are pictures, with the paper's own flags, and the lens
# drawings. Run it at the top of the repository: scenes/livroom/figures.sh [FOLDER], default docs/guide.
# IVCAM names the program (default target/release/ivcam), SAMPLES the rays a pixel (default 48; the paper
# says "typically 16"). The factors of -z are focal lengths over those of the lenses, which are about
# 100 mm.
#
# What is not the paper's: the lenses have names here, and --pupil exit aims at the exit pupil. By the
# rear element, as in 1999, three of four rays of the telephoto are lost and the picture is grainy.
set -eu
to=${1:-docs/guide}
ivcam=${IVCAM:-target/release/ivcam}
samples=${SAMPLES:-48}
room=scenes/livroom/livroom.iv
lamp=scenes/desk-lamp/desk-lamp.iv

shoot() { # picture, camera, distance, factor, lens, scene, what else
  picture=$1 camera=$2 distance=$3 factor=$4 lens=$5 scene=$6
  shift 6
  "$ivcam" -batch -j "$samples" -s r -f "$distance" -z "$factor" -camread "camera/cam-$camera.dat" \
    --lens "$lens" --pupil exit "$@" -o "$to/$picture.png" "$scene"
}

# Figures 1 and 2, for real: one lamp, its foot equally large, the bulb in focus.
shoot figure-1  9 0.62 0.2   wide-angle "$lamp" --aperture f/11
shoot figure-2 10 6.38 1.803 telephoto  "$lamp"

# Figures 10 to 12: focus on the telephone, then on the book.
shoot figure-10      1  1.20 0.2   wide-angle   "$room"
shoot figure-10-book 1  1.99 0.2   wide-angle   "$room"
shoot figure-11      2  3.60 0.596 double-gauss "$room"
shoot figure-11-book 2  4.38 0.596 double-gauss "$room"
shoot figure-12      3 10.80 1.803 telephoto    "$room"
shoot figure-12-book 3 11.57 1.803 telephoto    "$room"

# The same from closer, where the blur is plain to see.
shoot closer-60mm       5 1.50 0.596 double-gauss "$room"
shoot closer-60mm-book  5 2.25 0.596 double-gauss "$room"
shoot closer-180mm      6 4.50 1.803 telephoto    "$room"
shoot closer-180mm-book 6 5.23 1.803 telephoto    "$room"

# Figures 3 to 5 and 13 to 16: the lenses, with principal planes, focal points and rays.
for lens in wide-angle double-gauss telephoto fisheye; do
  "$ivcam" lens "$lens" --diagram "$to/lens-$lens.svg"
done
