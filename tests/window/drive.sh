#!/usr/bin/env bash
# Drives the real window on a display without a screen, with OpenGL in software. In the form of
# today and in that of 1999 it opens the living room, chooses a lens, focuses by a click, turns the
# wheel, stops down, orbits and saves. It compares the saved picture with the one in the window, and, byte for
# byte, with the one that the batch command makes.
#
#   cargo build --release
#   tests/window/drive.sh target/release/ivcam FOLDER
#
# Needs Xvfb, xdotool, ImageMagick (import, convert, compare), strings and Mesa's software OpenGL.
# The places of the controls are in places.txt, which `cargo test --features viewer-tests places`
# checks and, with UPDATE=1, writes.
set -euo pipefail
ivcam=$(realpath "$1") out=$(realpath -m "${2:-/tmp/ivcam-window}")
cd "$(dirname "$0")/../.."
mkdir -p "$out"; rm -f "$out"/*.png "$out"/*.txt
export DISPLAY=:${DISPLAY_NUMBER:-77} LIBGL_ALWAYS_SOFTWARE=1 XDG_STATE_HOME=$out
# The window is 860 high, and leaves 72 points of the screen to the desktop.
Xvfb "$DISPLAY" -screen 0 1360x940x24 -nolisten tcp >"$out/xvfb.txt" 2>&1 & xvfb=$!
window=$xvfb
trap 'kill "$window" "$xvfb" 2>/dev/null || true' EXIT

# place NAME: left, top, width and height of a control, in pixels.
place() { awk -F '\t' -v name="$1" '$1 == name { print $2 }' tests/window/places.txt; }
# middle NAME: the middle of a control.
middle() { read -r x y w h <<<"$(place "$1")"; echo $((x + w / 2)) $((y + h / 2)); }
shot() { import -window root "$out/$form-$1.png"; }
click() { xdotool mousemove "$1" "$2"; sleep 0.4; xdotool click 1; sleep "${3:-1.5}"; }
# drag BUTTON X Y DX DY: drags in four steps.
drag() {
  xdotool mousemove "$2" "$3"; sleep 0.3; xdotool mousedown "$1"; sleep 0.3
  for _ in 1 2 3 4; do xdotool mousemove_relative -- "$4" "$5"; sleep 0.2; done
  xdotool mouseup "$1"; sleep 1
}
# differs A B: the root mean square difference of two pictures, as a share of white.
differs() { compare -metric RMSE "$1" "$2" null: 2>&1 | sed 's/.*(\(.*\)).*/\1/' || true; }

drive() {
  form=$1; shift
  local picture="$out/$form.png" left top width height
  "$ivcam" "$@" --efl 20mm --size 416x277 -o "$picture" >"$out/$form.txt" 2>&1 & window=$!
  for _ in $(seq 100); do
    xdotool search --name 'ivcam$' >"$out/id.txt" 2>/dev/null && break
    kill -0 "$window" || { cat "$out/$form.txt"; exit 1; }
    sleep 0.3
  done
  xdotool windowmove "$(head -1 "$out/id.txt")" 0 0
  sleep "${PATIENCE:-12}"
  shot 1-open
  click $(middle angenieux-28) 4
  shot 2-lens
  read -r left top width height <<<"$(place Picture)"
  # The telephone, which is below the middle; the mouse waits until the click has focused.
  click $((left + width / 2)) $((top + 2 * height / 3)) 6
  shot 3-focus
  drag 1 $(middle 'Focus wheel') 3 0
  shot 4-wheel
  click $(middle f/4)
  shot 5-stop
  drag 3 $((left + width / 2)) $((top + height / 2)) 12 0
  sleep "${PATIENCE:-12}"
  shot 6-orbit
  click $(middle 'Save picture') 1
  for _ in $(seq 400); do [ -s "$picture" ] && break; sleep 0.3; done
  sleep 1
  shot 7-saved
  kill "$window"; wait "$window" 2>/dev/null || true

  convert "$out/$form-6-orbit.png" -crop "${width}x$height+$left+$top" +repage \
    -resize 416x277! "$out/$form-seen.png"
  convert "$out/$form-1-open.png" -crop "${width}x$height+$left+$top" +repage \
    -resize 416x277! "$out/$form-before.png"
  local same other
  same=$(differs "$out/$form-seen.png" "$picture")
  other=$(differs "$out/$form-before.png" "$picture")
  echo "$form: the saved picture differs by $same from the one in the window, by $other from the first"
  awk -v a="$same" -v b="$other" 'BEGIN { exit !(a < 0.05 && a < 0.5 * b) }'

  # The batch command is in the picture itself, up to the scene: what follows is the checksum.
  local command
  command=$(strings -n 8 "$picture" | grep -o -m1 '^ivcam .*/livroom\.iv' || true)
  [ -n "$command" ] || { echo "no command in the picture"; exit 1; }
  echo "$command" | tee "$out/$form-command.txt"
  mv "$picture" "$out/$form-saved.png"
  eval "\"$ivcam\" ${command#ivcam }" >"$out/$form-batch.txt" 2>&1
  cmp "$out/$form-saved.png" "$picture"
  echo "$form: the saved picture is the batch picture, bit for bit"
}

for _ in $(seq 100); do xdotool getmouselocation >/dev/null 2>&1 && break; sleep 0.2; done
drive today view scenes/livroom/livroom.iv --samples 16
drive 1999 scenes/livroom/livroom.iv
