#!/usr/bin/env bash
# Drives the real window on a display without a screen, with OpenGL in software: opens the living
# room, chooses a lens, focuses by a click, turns the wheel, stops down and saves; then makes the
# same picture by the batch command and compares the two files.
#
#   cargo build --release --features viewer
#   tests/window/drive.sh target/release/ivcam FOLDER
#
# Needs Xvfb, xdotool, strings, ImageMagick's import (for the screenshots) and Mesa's software OpenGL. Places
# are those of a window of 1360x860 with egui's own font.
set -euo pipefail
ivcam=$(realpath "$1") out=$(realpath -m "${2:-/tmp/ivcam-window}")
cd "$(dirname "$0")/../.."
mkdir -p "$out"; rm -f "$out"/*.png "$out"/*.txt
export DISPLAY=:${DISPLAY_NUMBER:-77} LIBGL_ALWAYS_SOFTWARE=1
Xvfb "$DISPLAY" -screen 0 1360x860x24 -nolisten tcp >"$out/xvfb.txt" 2>&1 & xvfb=$!
trap 'kill "${window:-$xvfb}" "$xvfb" 2>/dev/null || true' EXIT
sleep 2

"$ivcam" view scenes/livroom/livroom.iv --efl 20mm --samples 4 -o "$out/window.png" >"$out/window.txt" 2>&1 & window=$!
for _ in $(seq 100); do
  xdotool search --name '^ivcam$' >"$out/id.txt" 2>/dev/null && break
  kill -0 "$window" || { cat "$out/window.txt"; exit 1; }
  sleep 0.3
done
sleep "${PATIENCE:-12}"
shot() { command -v import >/dev/null && import -window root "$out/$1.png" || true; }
click() { xdotool mousemove "$1" "$2"; sleep 0.4; xdotool click 1; sleep "${3:-1.5}"; }
shot 1-open

# A lens of the menu.
click ${LENS:-100 520}
shot 2-lens
# A click on the picture focuses there.
click ${FOCUS:-700 480} 5
shot 3-focus
# The focus wheel, dragged.
xdotool mousemove ${WHEEL:-1180 61} mousedown 1; sleep 0.2
for step in 1 2 3 4; do xdotool mousemove_relative 4 0; sleep 0.1; done
xdotool mouseup 1; sleep 2
shot 4-wheel
# Stops down.
click ${STOP:-1190 323}
shot 5-stop
click ${SAVE:-1276 725} 1
for _ in $(seq 200); do [ -s "$out/window.png" ] && break; sleep 0.3; done
shot 6-saved

# The batch command is in the picture itself, up to the scene: what follows is the chunk's checksum.
command=$(strings -n 8 "$out/window.png" | grep -o -m1 '^ivcam render .*/livroom\.iv' || true)
[ -n "$command" ] || { echo "no command in the picture"; exit 1; }
echo "$command" | tee "$out/command.txt"
mv "$out/window.png" "$out/saved.png"
eval "\"$ivcam\" ${command#ivcam }"
cmp "$out/saved.png" "$out/window.png" && echo "the saved picture is the batch picture, bit for bit"
