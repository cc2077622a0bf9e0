// Rotations of a camera: quaternions [x, y, z, w], and vectors of three numbers.

export const add = (a, b) => a.map((v, i) => v + b[i]);
export const scaled = (a, s) => a.map((v) => v * s);

function cross([a, b, c], [x, y, z]) {
    return [b * z - c * y, c * x - a * z, a * y - b * x];
}

export function rotated([x, y, z, w], v) {
    const t = scaled(cross([x, y, z], v), 2);
    return add(add(v, scaled(t, w)), cross([x, y, z], t));
}

export function product([ax, ay, az, aw], [bx, by, bz, bw]) {
    return [
        aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz,
    ];
}

export function about(axis, angle) {
    return [...scaled(axis, Math.sin(angle / 2)), Math.cos(angle / 2)];
}

/** The axis and the angle of a rotation, as Inventor writes them. */
export function axisAngle([x, y, z, w]) {
    const length = Math.hypot(x, y, z);
    return length < 1e-12 ? [0, 0, 1, 0] : [x / length, y / length, z / length, 2 * Math.atan2(length, w)];
}

/** Turns a pose about a point that is `distance` before it: right and up in radians. */
export function orbited({ position, orientation }, distance, right, up) {
    const pivot = add(position, rotated(orientation, [0, 0, -distance]));
    const turned = product(about([0, 1, 0], right), product(orientation, about([1, 0, 0], up)));
    const length = Math.hypot(...turned);
    const fresh = scaled(turned, 1 / length);
    return { orientation: fresh, position: add(pivot, rotated(fresh, [0, 0, distance])) };
}

/** Moves a pose in its own space. */
export function moved({ position, orientation }, by) {
    return { orientation, position: add(position, rotated(orientation, by)) };
}

/** A camera file with another position and orientation. */
export function posed(camera, { position, orientation }) {
    const numbers = (list) => list.map((n) => String(Number(n.toPrecision(9)))).join(' ');
    const line = (text, field, value) => (new RegExp(`\\b${field}\\b`).test(text)
        ? text.replace(new RegExp(`\\b${field}\\b[^\\n}]*`), `${field} ${value}`)
        : text.replace('{', `{\n  ${field} ${value}`));
    const placed = line(camera, 'position', numbers(position));
    return line(placed, 'orientation', numbers(axisAngle(orientation)));
}
