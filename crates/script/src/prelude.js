// The part of a script's world that is written in its own language: the types of VRML97, annex C,
// the `Browser` object, and guards around functions whose work does not show in the number of
// instructions. It is a function of the host's functions and of the script's interface, and returns
// what the host calls.
(function (host, fields, seed, direct) {
"use strict";
const global = globalThis, Proxy = globalThis.Proxy, apply = Reflect.apply, ID = Symbol(), ELEMENT = Symbol();
const number = v => { const n = +v; return n === n ? n : 0; };
const integer = v => number(v) | 0;
const boolean = v => typeof v === "string" ? /^true$/i.test(v) : !!v;
const string = v => v === null || v === undefined ? "" : String(v);
const define = (to, name, value) =>
    Object.defineProperty(to, name, { value, writable: true, configurable: true });
const methods = (type, list) => {
    for (const name in list) define(type.prototype, name, list[name]);
};
const words = text => String(text).split(/[\s,]+/).filter(w => w !== "").map(number);

// ---- Single values ----

// Creates a type of a fixed number of named components, which are also elements 0, 1, ….
function tuple(name, parts, initial) {
    const type = function (...given) {
        if (!new.target) return new type(...given);
        let from = given;
        if (given.length === 1 && typeof given[0] === "object" && given[0] !== null) from = given[0];
        else if (given.length === 1 && typeof given[0] === "string" && parts.length > 1)
            from = words(given[0]);
        for (let i = 0; i < parts.length; i++)
            this[parts[i]] = from[i] === undefined ? initial[i] : number(from[i]);
    };
    parts.forEach((part, i) => Object.defineProperty(type.prototype, i, {
        get() { return this[part]; }, set(v) { this[part] = number(v); },
    }));
    methods(type, { toString() { return parts.map(p => this[p]).join(" "); } });
    define(type, "parts", parts);
    Object.defineProperty(type, "name", { value: name });
    define(global, name, type);
    return type;
}
const SFVec2f = tuple("SFVec2f", ["x", "y"], [0, 0]);
const SFVec3f = tuple("SFVec3f", ["x", "y", "z"], [0, 0, 0]);
const SFColor = tuple("SFColor", ["r", "g", "b"], [0, 0, 0]);
const Rotation = tuple("SFRotation", ["x", "y", "z", "angle"], [0, 0, 1, 0]);
const dot = (a, b) => a.x * b.x + a.y * b.y + (a.z === undefined ? 0 : a.z * b.z);

for (const type of [SFVec2f, SFVec3f]) {
    const each = (v, f) => new type(...type.parts.map(p => f(v[p], p)));
    methods(type, {
        add(v) { return each(this, (a, p) => a + number(v[p])); },
        subtract(v) { return each(this, (a, p) => a - number(v[p])); },
        multiply(n) { return each(this, a => a * number(n)); },
        divide(n) { return each(this, a => a / number(n)); },
        negate() { return each(this, a => -a); },
        dot(v) { return dot(this, v); },
        length() { return Math.sqrt(dot(this, this)); },
        normalize() { const l = this.length(); return l > 0 ? this.divide(l) : each(this, a => a); },
    });
}
methods(SFVec3f, {
    cross(v) {
        return new SFVec3f(this.y * v.z - this.z * v.y, this.z * v.x - this.x * v.z,
            this.x * v.y - this.y * v.x);
    },
});
methods(SFColor, {
    // Hue is from 0 to 360, saturation and value from 0 to 1.
    setHSV(h, s, v) {
        const at = n => { const k = (n + number(h) / 60) % 6;
            return v - v * s * Math.max(0, Math.min(k, 4 - k, 1)); };
        this.r = at(5); this.g = at(3); this.b = at(1);
    },
    getHSV() {
        const { r, g, b } = this, high = Math.max(r, g, b), range = high - Math.min(r, g, b);
        let h = 0;
        if (range > 0) {
            if (high === r) h = ((g - b) / range + 6) % 6;
            else if (high === g) h = (b - r) / range + 2;
            else h = (r - g) / range + 4;
        }
        return [60 * h, high > 0 ? range / high : 0, high];
    },
});

// A rotation as a quaternion (x, y, z, w), and back. The angle is from 0 to 2π.
function quaternion(r) {
    const l = Math.sqrt(dot(r, r)), s = l > 0 ? Math.sin(r.angle / 2) / l : 0;
    return [r.x * s, r.y * s, r.z * s, l > 0 ? Math.cos(r.angle / 2) : 1];
}
function rotation(q) {
    const l = Math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    if (!(l > 1e-12)) return new Rotation(0, 0, 1, 0);
    return new Rotation(q[0] / l, q[1] / l, q[2] / l, 2 * Math.atan2(l, q[3]));
}
// The rotation b after the rotation a.
const after = (a, b) => [
    b[3] * a[0] + b[0] * a[3] + b[1] * a[2] - b[2] * a[1],
    b[3] * a[1] - b[0] * a[2] + b[1] * a[3] + b[2] * a[0],
    b[3] * a[2] + b[0] * a[1] - b[1] * a[0] + b[2] * a[3],
    b[3] * a[3] - b[0] * a[0] - b[1] * a[1] - b[2] * a[2],
];
function between(from, to) {
    const a = from.normalize(), b = to.normalize(), axis = a.cross(b), cosine = dot(a, b);
    if (cosine < -0.9999999) {
        const side = Math.abs(a.x) < 0.9 ? new SFVec3f(1, 0, 0) : new SFVec3f(0, 1, 0);
        const across = a.cross(side).normalize();
        return new Rotation(across.x, across.y, across.z, Math.PI);
    }
    return rotation([axis.x, axis.y, axis.z, 1 + cosine]);
}
const SFRotation = function (...given) {
    if (!new.target) return new SFRotation(...given);
    const [a, b] = given;
    if (a instanceof SFVec3f && b instanceof SFVec3f) return between(a, b);
    if (a instanceof SFVec3f) return new Rotation(a.x, a.y, a.z, number(b));
    return new Rotation(...given);
};
SFRotation.prototype = Rotation.prototype;
SFRotation.parts = Rotation.parts;
define(Rotation.prototype, "constructor", SFRotation);
define(global, "SFRotation", SFRotation);
methods(SFRotation, {
    getAxis() { return new SFVec3f(this.x, this.y, this.z); },
    setAxis(v) { this.x = number(v.x); this.y = number(v.y); this.z = number(v.z); },
    inverse() { return new SFRotation(this.x, this.y, this.z, -this.angle); },
    multiply(r) { return rotation(after(quaternion(this), quaternion(r))); },
    multVec(v) {
        const q = quaternion(this), u = new SFVec3f(q[0], q[1], q[2]);
        const t = u.cross(v).multiply(2);
        return new SFVec3f(v.x, v.y, v.z).add(t.multiply(q[3])).add(u.cross(t));
    },
    slerp(to, share) {
        const a = quaternion(this), s = number(share);
        let b = quaternion(to), c = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
        if (c < 0) { b = b.map(n => -n); c = -c; }
        const angle = Math.acos(Math.min(1, c));
        const [p, q] = angle < 1e-6 ? [1 - s, s]
            : [Math.sin((1 - s) * angle) / Math.sin(angle), Math.sin(s * angle) / Math.sin(angle)];
        return rotation(a.map((n, i) => p * n + q * b[i]));
    },
});

function SFImage(x, y, comp, array) {
    if (!new.target) return new SFImage(x, y, comp, array);
    this.x = integer(x); this.y = integer(y); this.comp = integer(comp);
    this.array = array === undefined ? new MFInt32() : coerce("MFInt32", array);
}
methods(SFImage, { toString() { return [this.x, this.y, this.comp].join(" "); } });
define(global, "SFImage", SFImage);

// ---- Lists ----

// Creates a list type. A list grows when an element beyond its end or its length is set, and the
// new elements have the type's default.
function list(name, kind) {
    const grow = (items, length) => {
        if (length > host.most) host.stop("a list of more than " + host.most + " elements");
        while (items.length < length) items.push(blank(kind));
    };
    const handler = {
        set(items, key, value) {
            const index = typeof key === "string" && key !== "" ? +key : NaN;
            if (key === "length") {
                const length = Math.max(0, integer(value));
                if (length < items.length) items.length = length; else grow(items, length);
            } else if (index >= 0 && index % 1 === 0) {
                grow(items, index);
                items[index] = coerce(kind, value);
            } else items[key] = value;
            return true;
        },
    };
    const type = function (...given) { return type.of(given, true); };
    // Makes a list of the elements of an array. They are converted unless they have the type.
    define(type, "of", (array, convert) => {
        const items = [];
        for (let i = 0; i < array.length; i++) items.push(convert ? coerce(kind, array[i]) : array[i]);
        Object.setPrototypeOf(items, type.prototype);
        return new Proxy(items, handler);
    });
    type.prototype = Object.create(Array.prototype);
    define(type.prototype, "constructor", type);
    define(type.prototype, ELEMENT, kind);
    methods(type, { toString() { return "[ " + this.join(", ") + " ]"; } });
    define(global, name, type);
    return type;
}
const lists = {};
for (const kind of ["Bool", "Color", "Float", "Int32", "Node", "Rotation", "String", "Time",
    "Vec2f", "Vec3f", "Double"]) lists["MF" + kind] = list("MF" + kind, "SF" + kind);
const { MFInt32, MFNode } = lists;

// ---- Matrices ----

// A matrix for row vectors, as VRML97 has it: the last row is the translation.
function VrmlMatrix(...given) {
    if (!new.target) return new VrmlMatrix(...given);
    const m = [];
    for (let i = 0; i < 16; i++)
        m.push(given[i] === undefined ? (i % 5 === 0 ? 1 : 0) : number(given[i]));
    Object.defineProperty(this, "m", { value: m, writable: true });
}
for (let i = 0; i < 4; i++) Object.defineProperty(VrmlMatrix.prototype, i, {
    get() {
        const m = this.m, row = {};
        for (let j = 0; j < 4; j++) Object.defineProperty(row, j, {
            get() { return m[4 * i + j]; }, set(v) { m[4 * i + j] = number(v); },
        });
        return row;
    },
});
const product = (a, b) => {
    const out = [];
    for (let i = 0; i < 4; i++) for (let j = 0; j < 4; j++) {
        let sum = 0;
        for (let k = 0; k < 4; k++) sum += a[4 * i + k] * b[4 * k + j];
        out.push(sum);
    }
    return out;
};
const turned = r => {
    const [x, y, z, w] = quaternion(r);
    return [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w), 0,
        2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w), 0,
        2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y), 0, 0, 0, 0, 1];
};
const moved = (v, sign) =>
    [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, sign * v.x, sign * v.y, sign * v.z, 1];
function inverse(m) {
    // Gauss-Jordan elimination with the largest pivot.
    const a = m.slice(), b = new VrmlMatrix().m;
    for (let c = 0; c < 4; c++) {
        let best = c;
        for (let r = c + 1; r < 4; r++)
            if (Math.abs(a[4 * r + c]) > Math.abs(a[4 * best + c])) best = r;
        const pivot = a[4 * best + c];
        if (pivot === 0) return new VrmlMatrix().m;
        for (let j = 0; j < 4; j++) for (const x of [a, b]) {
            const t = x[4 * c + j]; x[4 * c + j] = x[4 * best + j] / pivot;
            if (best !== c) x[4 * best + j] = t;
        }
        for (let r = 0; r < 4; r++) if (r !== c) {
            const f = a[4 * r + c];
            for (let j = 0; j < 4; j++) {
                a[4 * r + j] -= f * a[4 * c + j];
                b[4 * r + j] -= f * b[4 * c + j];
            }
        }
    }
    return b;
}
methods(VrmlMatrix, {
    setTransform(translation, rotation, scale, scaleOrientation, center) {
        let m = new VrmlMatrix().m;
        if (center) m = product(m, moved(center, -1));
        if (scale) {
            const s = [scale.x, 0, 0, 0, 0, scale.y, 0, 0, 0, 0, scale.z, 0, 0, 0, 0, 1];
            if (scaleOrientation) m = product(m, turned(scaleOrientation.inverse()));
            m = product(m, s);
            if (scaleOrientation) m = product(m, turned(scaleOrientation));
        }
        if (rotation) m = product(m, turned(rotation));
        if (center) m = product(m, moved(center, 1));
        if (translation) m = product(m, moved(translation, 1));
        this.m = m;
    },
    getTransform(translation, rotation_, scale) {
        const m = this.m, rows = [0, 4, 8].map(i => new SFVec3f(m[i], m[i + 1], m[i + 2]));
        const sizes = rows.map(r => r.length());
        if (dot(rows[0].cross(rows[1]), rows[2]) < 0) sizes.forEach((s, i) => { sizes[i] = -s; });
        const unit = rows.map((r, i) => sizes[i] === 0 ? r : r.divide(sizes[i]));
        if (translation) { translation.x = m[12]; translation.y = m[13]; translation.z = m[14]; }
        if (scale) { scale.x = sizes[0]; scale.y = sizes[1]; scale.z = sizes[2]; }
        if (rotation_) {
            const [a, b, c] = unit, w = Math.sqrt(Math.max(0, 1 + a.x + b.y + c.z)) / 2;
            let q = [b.z - c.y, c.x - a.z, a.y - b.x].map(n => n / (4 * w));
            if (w < 1e-6) {
                const part = (p, s) => Math.sqrt(Math.max(0, 1 + p)) / 2 * s;
                q = [part(a.x - b.y - c.z, 1), part(b.y - a.x - c.z, a.y + b.x < 0 ? -1 : 1),
                    part(c.z - a.x - b.y, c.x + a.z < 0 ? -1 : 1)];
            }
            const r = rotation([q[0], q[1], q[2], w]);
            rotation_.x = r.x; rotation_.y = r.y; rotation_.z = r.z; rotation_.angle = r.angle;
        }
    },
    inverse() { return new VrmlMatrix(...inverse(this.m)); },
    transpose() { return new VrmlMatrix(...this.m.map((_, i) => this.m[i % 4 * 4 + (i >> 2)])); },
    multLeft(a) { return new VrmlMatrix(...product(a.m, this.m)); },
    multRight(a) { return new VrmlMatrix(...product(this.m, a.m)); },
    multVecMatrix(v) {
        const m = this.m, at = j => v.x * m[j] + v.y * m[4 + j] + v.z * m[8 + j] + m[12 + j];
        const w = at(3) || 1;
        return new SFVec3f(at(0) / w, at(1) / w, at(2) / w);
    },
    multMatrixVec(v) {
        const m = this.m, at = i => m[4 * i] * v.x + m[4 * i + 1] * v.y + m[4 * i + 2] * v.z + m[4 * i + 3];
        const w = at(3) || 1;
        return new SFVec3f(at(0) / w, at(1) / w, at(2) / w);
    },
    toString() { return this.m.join(" "); },
});
define(global, "VrmlMatrix", VrmlMatrix);

// ---- Nodes ----

const nodes = new Map();
// The values that were read from nodes since the call began. A script may change them in place.
const handed = new Map();

function SFNode(text) {
    if (text instanceof SFNode) return text;
    return text === undefined ? null : create(text)[0] || null;
}
methods(SFNode, { toString() { return host.className(this[ID]) + " { }"; } });
define(global, "SFNode", SFNode);

const nodeHandler = {
    get(target, key) {
        if (key === ID) return target.id;
        if (typeof key === "symbol") return undefined;
        const place = target.id + "." + key, known = handed.get(place);
        if (known) return known.value;
        const found = host.get(target.id, key);
        if (!found) return SFNode.prototype[key];
        const [kind, before] = found, value = make(kind, before);
        if (typeof value === "object" && value !== null && !(value instanceof SFNode))
            handed.set(place, { id: target.id, key, kind, value, before });
        return value;
    },
    set(target, key, value) {
        const kind = host.kind(target.id, String(key));
        if (!kind) return true;
        const data = flat(kind, coerce(kind, value));
        handed.forEach((h, place) => { if (h.id === target.id) { flushOne(h); handed.delete(place); } });
        host.put(target.id, key, data);
        return true;
    },
};
function node(id) {
    if (!(id >= 0)) return null;
    let found = nodes.get(id);
    if (!found) {
        const target = Object.create(SFNode.prototype);
        target.id = id;
        found = new Proxy(target, nodeHandler);
        nodes.set(id, found);
    }
    return found;
}
function flushOne({ id, key, kind, value, before }) {
    if (!direct) return;
    const now = flat(kind, value);
    if (!same(before, now)) host.put(id, key, now);
}
const same = (a, b) => {
    if (a.length !== b.length) return false;
    for (let i = 0; i < a.length; i++) if (a[i] !== b[i]) return false;
    return true;
};
const create = text => host.create(string(text)).map(node);

// ---- Values of every type ----

const tuples = { SFVec2f, SFVec3f, SFColor, SFRotation };
const scalars = { SFBool: boolean, SFInt32: integer, SFFloat: number, SFTime: number,
    SFDouble: number, SFString: string };
function blank(kind) {
    if (scalars[kind]) return scalars[kind](kind === "SFString" ? "" : 0);
    if (tuples[kind]) return new tuples[kind]();
    if (lists[kind]) return new lists[kind]();
    return kind === "SFImage" ? new SFImage(0, 0, 0) : null;
}
// Converts a value to a type. A value that has the type already stays the same object.
function coerce(kind, value) {
    if (scalars[kind]) {
        if (Array.isArray(value) && (kind !== "SFString" || typeof value[0] === "string"))
            value = value[0];
        return scalars[kind](value);
    }
    const type = tuples[kind];
    if (type) {
        if (value instanceof type) return value;
        if (Array.isArray(value) && value.length > 0 && value[0] instanceof type) return value[0];
        if (typeof value === "string") return new type(...words(value));
        return typeof value === "object" && value !== null ? new type(...components(value)) : new type();
    }
    const many = lists[kind];
    if (many) {
        if (value instanceof many) return value;
        if (Array.isArray(value)) return many.of(value, true);
        return value === null || value === undefined ? new many() : new many(value);
    }
    if (kind === "SFImage") return value instanceof SFImage ? value : new SFImage(0, 0, 0);
    if (Array.isArray(value)) value = value[0];
    return value instanceof SFNode ? value : null;
}
const components = v =>
    Array.isArray(v) ? v : (v.constructor && v.constructor.parts || []).map(p => v[p]);
const cut = (data, start, length) => {
    const out = [];
    for (let i = 0; i < length; i++) out.push(data[start + i]);
    return out;
};
// Makes a value from its numbers, strings or node numbers.
function make(kind, data) {
    if (scalars[kind]) return scalars[kind](data[0]);
    if (kind === "SFNode") return node(data[0]);
    if (tuples[kind]) return new tuples[kind](...data);
    if (kind === "SFImage") return new SFImage(data[0], data[1], data[2], data.slice(3));
    const element = lists[kind].prototype[ELEMENT], type = tuples[element], items = [];
    if (!type) for (let i = 0; i < data.length; i++) items.push(make(element, [data[i]]));
    else for (let i = 0, n = type.parts.length; i + n <= data.length; i += n)
        items.push(n === 3 ? new type(data[i], data[i + 1], data[i + 2]) : new type(...cut(data, i, n)));
    return lists[kind].of(items, false);
}
// Returns the numbers, strings or node numbers of a value.
function flat(kind, value, out = []) {
    if (scalars[kind]) out.push(kind === "SFBool" ? (value ? 1 : 0) : scalars[kind](value));
    else if (kind === "SFNode") out.push(value === null || value === undefined ? -1 : value[ID]);
    else if (tuples[kind]) for (const part of tuples[kind].parts) out.push(number(value[part]));
    else if (kind === "SFImage") {
        out.push(value.x, value.y, value.comp);
        for (const pixel of value.array) out.push(integer(pixel));
    } else for (let i = 0; i < value.length; i++) flat(lists[kind].prototype[ELEMENT], value[i], out);
    return out;
}

// ---- The interface of the script ----

const outputs = new Map();
for (const [access, kind, name, data] of fields) {
    if (access === "eventIn") continue;
    const entry = { kind, value: data ? make(kind, data) : blank(kind), sent: false, before: null };
    const sends = access !== "field";
    if (sends) outputs.set(access === "eventOut" ? name : name + "_changed", entry);
    const accessor = {
        configurable: true, enumerable: true,
        get() {
            if (sends && entry.before === null && typeof entry.value === "object")
                entry.before = flat(kind, entry.value);
            return entry.value;
        },
        set(value) { entry.value = coerce(kind, value); entry.sent = sends; },
    };
    Object.defineProperty(global, name, accessor);
    if (access === "exposedField") Object.defineProperty(global, name + "_changed", accessor);
}

// ---- The browser ----

const told = name => () => { host.tell(name); };
const routeEnds = (from, output, to, input) => from instanceof SFNode && to instanceof SFNode
    ? [from[ID], string(output), to[ID], string(input)] : null;
const Browser = {
    getName: () => host.name, getVersion: () => host.version,
    getCurrentSpeed: () => 0, getCurrentFrameRate: () => host.frameRate,
    getWorldURL: () => host.world, getTime: () => host.now(),
    replaceWorld: told("replaceWorld"), loadURL: told("loadURL"), setDescription() { },
    createVrmlFromString: text => MFNode.of(create(text), false),
    createVrmlFromURL(urls, to, event) {
        const loaded = host.load(flat("MFString", coerce("MFString", urls)));
        if (to instanceof SFNode && loaded.length > 0) host.send(to[ID], string(event), loaded);
    },
    addRoute(...ends) { const r = routeEnds(...ends); if (r) host.route(true, ...r); },
    deleteRoute(...ends) { const r = routeEnds(...ends); if (r) host.route(false, ...r); },
    print(...texts) { host.print(texts.map(string).join(" ")); },
};
Browser.println = Browser.print;
define(global, "Browser", Browser);
for (const name of ["print", "println", "trace"]) define(global, name, Browser.print);
define(global, "TRUE", true);
define(global, "FALSE", false);
define(global, "NULL", null);

// ---- Guards ----

// The work of these functions grows with the length of what they are given.
function guard(object, names, work) {
    for (const name of names) {
        const original = object[name];
        if (typeof original !== "function") continue;
        define(object, name, function (...given) {
            host.charge(work(this, given));
            return host.grow(apply(original, this, given));
        });
    }
}
const length = v => v === null || v === undefined ? 0 : number(v.length);
guard(Array.prototype, ["concat", "copyWithin", "every", "fill", "filter", "find", "findIndex",
    "forEach", "includes", "indexOf", "lastIndexOf", "map", "reduce", "reduceRight", "reverse",
    "shift", "slice", "some", "sort", "splice", "toLocaleString", "unshift"],
    (list, given) => {
        let sum = length(list) + given.length;
        for (let i = 0; i < given.length; i++) sum += length(given[i]);
        return sum;
    });
const join = Array.prototype.join;
define(Array.prototype, "join", function (gap) {
    host.charge(length(this));
    const texts = [];
    let size = 0, between = gap === undefined ? "," : String(gap);
    for (let i = 0; i < this.length; i++) {
        const text = string(this[i]);
        size += text.length + between.length;
        host.fits(size);
        texts.push(text);
    }
    return host.grow(apply(join, texts, [between]));
});
define(Array.prototype, "toString", function () { return this.join(); });
guard(Function.prototype, ["apply"], (_, given) => length(given[1]));
guard(Array, ["from"], (_, given) => length(given[0]));
guard(String.prototype, ["split", "match", "search", "indexOf", "lastIndexOf", "includes",
    "toUpperCase", "toLowerCase", "trim", "substring", "substr", "slice", "localeCompare"],
    (text) => length(String(text)) / 16);
guard(String.prototype, ["concat"], (text, given) => {
    let size = String(text).length;
    for (let i = 0; i < given.length; i++) size += String(given[i]).length;
    host.fits(size);
    return 1;
});
guard(String.prototype, ["repeat"], (text, given) => {
    host.fits(String(text).length * number(given[0]));
    return 1;
});
guard(String.prototype, ["padStart", "padEnd"], (_, given) => (host.fits(number(given[0])), 1));
guard(String.prototype, ["replace", "replaceAll"], (text, given) => {
    const size = String(text).length, by = given[1];
    if (typeof by === "function")
        given[1] = function (...found) { return host.grow(string(apply(by, undefined, found))); };
    else {
        const each = String(by);
        host.fits((size + 1) * (each.length + 1 + size * (each.split("$").length - 1)));
    }
    return size / 16;
});
const exec = RegExp.prototype.exec;
define(RegExp.prototype, "exec", function (text) {
    host.pattern(String(this.source), String(text).length);
    return apply(exec, this, [text]);
});
// The engine remembers where properties are, so they are emptied and not deleted.
define(String, "raw", undefined);
for (const name of ["flat", "flatMap", "toSorted", "toSpliced", "toReversed", "with"])
    define(Array.prototype, name, undefined);
// Marsaglia's xorshift generator with 32 bits of state, so that a scene is the same every time.
let state = seed | 0 || 1;
define(Math, "random", () => {
    state ^= state << 13; state ^= state >>> 17; state ^= state << 5;
    return (state >>> 0) / 4294967296;
});
Object.defineProperty(global, host.growName, { value: host.grow });
for (const name in host.math) define(Math, name, host.math[name]);
define(global, "eval", text => typeof text === "string" ? host.evaluate(text) : text);
const kept = new Set(["Object", "Function", "Array", "String", "Number", "Boolean", "Math", "Date",
    "RegExp", "Error", "EvalError", "RangeError", "ReferenceError", "SyntaxError", "TypeError",
    "URIError", "AggregateError", "Map", "Set", "Symbol", "NaN", "Infinity", "undefined", "globalThis",
    "parseInt", "parseFloat", "isNaN", "isFinite", "escape", "unescape", "encodeURI", "decodeURI",
    "encodeURIComponent", "decodeURIComponent", "eval", "Browser", "TRUE", "FALSE", "NULL", "print",
    "println", "trace", "SFImage", "SFNode", "SFRotation", "VrmlMatrix", host.growName,
    ...Object.keys(tuples), ...Object.keys(lists), ...fields.map(f => f[2]),
    ...fields.map(f => f[2] + "_changed")]);
for (const name of Object.getOwnPropertyNames(global))
    if (!kept.has(name)) global[name] = undefined;

// ---- What the host calls ----

return {
    call(name, ...given) {
        const f = global[name];
        if (typeof f === "function") { apply(f, undefined, given); return true; }
        return false;
    },
    // Delivers an event to the function of its name, or to an exposedField.
    receive(name, kind, data, time, exposed) {
        const value = make(kind, data);
        if (exposed) global[exposed] = value;
        const called = this.call(name, value, time);
        if (exposed && !called) this.call(name === exposed ? "set_" + exposed : exposed, value, time);
    },
    // Returns the name, type and data of each output that the script assigned since the last time.
    collect() {
        const out = [];
        handed.forEach(flushOne);
        handed.clear();
        outputs.forEach((entry, name) => {
            const data = entry.sent || entry.before !== null ? flat(entry.kind, entry.value) : null;
            if (entry.sent || data !== null && !same(entry.before, data)) out.push([name, entry.kind, data]);
            entry.sent = false;
            entry.before = null;
        });
        return out;
    },
};
})
