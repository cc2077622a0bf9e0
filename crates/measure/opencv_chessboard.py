"""Compares cameras that `ivcam compare --fit` found with OpenCV's calibration of the same pictures.

    python opencv_chessboard.py PICTURES LEFT02.yml=FOUND.dat[,X,Y] ...

PICTURES is the folder of OpenCV's left01.jpg to left14.jpg. FOUND.dat is a camera found for left02.jpg with
scenes/chessboard/chessboard.iv. LEFT02.yml is its lens, by `ivcam lens LENS --export opencv` with the focal length
that was found, or `none` for a pinhole. X,Y is the principal point in pixels, if the lens was not shifted to
OpenCV's. Lengths in space are those of squares of 30 mm. Needs numpy and opencv-python.
"""
import re
import sys
from pathlib import Path

import cv2
import numpy as np

SQUARE = 0.03
SIZE = (640, 480)
PICTURE = "left02"
FLIP = np.diag([1.0, -1.0, -1.0])  # OpenCV: y down, z forward; Inventor: y up, z back
GRID = np.zeros((54, 3), np.float32)
GRID[:, :2] = np.mgrid[0:9, 0:6].T.reshape(-1, 2)
MIDDLE = np.array([4, 2.5, 0])


def corners(path):
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    found, at = cv2.findChessboardCorners(picture, (9, 6))
    assert found, path
    return cv2.cornerSubPix(picture, at, (5, 5), (-1, -1), (3, 100, 1e-4))


def camera(rotation, translation):
    """The orientation and the center of projection, in the space of the scene and in meters."""
    turn = FLIP @ cv2.Rodrigues(rotation)[0] @ FLIP
    shift = SQUARE * FLIP @ (FLIP @ turn @ FLIP @ MIDDLE + translation.ravel())
    return turn.T, -turn.T @ shift


def found_camera(path):
    text = Path(path).read_text()
    numbers = {name: [float(x) for x in words.split()] for name, words in re.findall(r"^  (\w+) (.*)$", text, re.M)}
    axis, angle = np.array(numbers["orientation"][:3]), numbers["orientation"][3]
    return cv2.Rodrigues(axis / np.linalg.norm(axis) * angle)[0], np.array(numbers["position"]), numbers["heightAngle"][0]


def lens(path, height_angle):
    """The focal length in pixels, the distortion, and how far the entrance pupil is behind the vertex in meters."""
    if path == "none":
        return SIZE[1] / 2 / np.tan(height_angle / 2), np.zeros(5), 0.0
    file = cv2.FileStorage(path, cv2.FILE_STORAGE_READ)
    behind = re.search(r"entrance pupil, (\S+) mm behind", Path(path).read_text())
    focal = file.getNode("camera_matrix").mat()[0, 0]
    return focal, file.getNode("distortion_coefficients").mat(), float(behind[1]) / 1000


def calibrated(points, matrix=None, distortion=None, flags=0):
    return cv2.calibrateCameraExtended([GRID] * len(points), points, SIZE, matrix, distortion, flags=flags)


def row(name, focal, turn, center, other, rms):
    other_turn, other_center = other
    angle = np.degrees(np.arccos(min(1.0, (np.trace(turn.T @ other_turn) - 1) / 2)))
    away = 1000 * (center - other_center)
    along = away @ turn[:, 2]
    across = np.sqrt(max(away @ away - along**2, 0.0))
    print(f"| {name} | {focal:.1f} | {along:+.2f} | {across:.2f} | {angle:.3f} | {rms:.2f} |")


def main():
    folder, cases = Path(sys.argv[1]), sys.argv[2:]
    paths = sorted(folder.glob("left[01][0-9].jpg"))
    points = [corners(path) for path in paths]
    index = [path.stem for path in paths].index(PICTURE)
    rms, matrix, distortion, turns, shifts, deviations, _, _ = calibrated(points)
    coefficients = " ".join(f"{k:.4f}" for k in distortion.ravel())
    print(f"{len(paths)} pictures: fx {matrix[0, 0]:.2f} ± {deviations[0, 0]:.2f}, fy {matrix[1, 1]:.2f}, principal point")
    print(f"{matrix[0, 2]:.2f} {matrix[1, 2]:.2f}, distortion {coefficients}, rms {rms:.3f} pixels\n")
    print("| camera | focal length, pixels | farther, mm | beside, mm | turned, degrees | corners, pixels |\n|---|---|---|---|---|---|")
    other = camera(turns[index], shifts[index])
    fixed = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_PRINCIPAL_POINT | cv2.CALIB_FIX_TANGENT_DIST
    fixed |= cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_ASPECT_RATIO

    def alone(name, bent):
        guess = matrix.copy()
        guess[0, 0] = guess[1, 1] = (matrix[0, 0] + matrix[1, 1]) / 2
        rms, guess, _, turns, shifts, deviations, spread, _ = calibrated([points[index]], guess, bent.copy(), fixed)
        row(name, guess[0, 0], *camera(turns[0], shifts[0]), other, rms)
        sigma = 1000 * SQUARE * spread.ravel()[3:]
        print(f"|   its standard errors | {deviations[1, 0]:.1f} | {sigma[2]:.2f} | {np.hypot(*sigma[:2]):.2f} | {np.degrees(np.linalg.norm(spread.ravel()[:3])):.3f} | |")

    alone(f"OpenCV, {PICTURE} alone", distortion)
    for case in cases:
        lens_file, found = case.split("=")
        found, *principal = found.split(",")
        turn, position, height_angle = found_camera(found)
        focal, bent, behind = lens(lens_file, height_angle)
        center = position + behind * turn[:, 2]
        x, y = map(float, principal) if principal else matrix[:2, 2]
        scene = (GRID - MIDDLE) * SQUARE * [1, -1, -1]
        seen = (scene - center) @ turn @ FLIP
        ours = np.array([[focal, 0, x], [0, focal, y], [0, 0, 1]])
        drawn, _ = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), ours, bent)
        off = drawn.reshape(-1, 2) - points[index].reshape(-1, 2)
        row(Path(found).stem, focal, turn, center, other, np.sqrt((off**2).sum(1).mean()))
        if lens_file != "none":
            alone(f"OpenCV, with the distortion of {Path(lens_file).stem}", bent)


main()
