// The files that a person opens: dropped, chosen, from a folder or from a .zip.

import { parts } from './files.js';
import { unzipped } from './zip.js';

const SCENE = /\.(iv|wrl|vrml|wrz|x3d|x3dv|x3dz|gltf|glb|obj|ply|stl)(\.gz)?$/i;
const LENS = /\.(dat|zmx|seq|len|lens|roa|lhlt)$/i;
const PICTURE = /\.(png|jpe?g|tiff?|exr|rgb|sgi|gif|bmp|ppm)$/i;
const MOST_BYTES = 1 << 30;

/** The beginning of a file as text. */
const head = (bytes, length = 65_536) => new TextDecoder('latin1').decode(bytes.subarray(0, length));

const isScene = (path, bytes) => SCENE.test(path) || /^#(Inventor|VRML)/.test(head(bytes, 16));

/** Whether a file is a lens. JSON is if it lists surfaces: other files are reports and losses. */
const isLens = (path, bytes) => LENS.test(path)
    || /\.json$/i.test(path) && /"(surfaces|surface_group|Surfaces)"\s*:/.test(head(bytes, bytes.length));

/** Whether a file is a camera for `--camera` and nothing else: all its nodes are cameras. */
function isCamera(bytes) {
    const text = bytes.length < 1e5 ? head(bytes).replace(/#.*/g, '') : '';
    const nodes = [...text.matchAll(/(\w+)\s*\{/g)].map(([, name]) => name);
    return nodes.length > 0 && nodes.every((name) => name.endsWith('Camera'));
}

/** Reads what a drop event has, folders included. */
export async function dropped(transfer) {
    const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
    if (entries.length === 0) {
        return [...transfer.files].map((file) => [file.name, file]);
    }
    const found = [];
    const walk = async (entry, path) => {
        if (entry.isFile) {
            found.push([path + entry.name, await new Promise((go, no) => entry.file(go, no))]);
            return;
        }
        const reader = entry.createReader();
        for (;;) {
            const some = await new Promise((go, no) => reader.readEntries(go, no));
            if (some.length === 0) {
                return;
            }
            for (const below of some) {
                await walk(below, `${path}${entry.name}/`);
            }
        }
    };
    for (const entry of entries) {
        await walk(entry, '');
    }
    return found;
}

/** Reads chosen files, with their paths in a chosen folder. */
export const chosen = (list) => [...list].map((file) => [file.webkitRelativePath || file.name, file]);

/** What macOS notes about files beside them. */
const NOTES = /(^|\/)(__MACOSX\/|\._|\.DS_Store$)/;

const areEqual = (a, b) => a.length === b.length && a.every((byte, i) => byte === b[i]);

/** Returns the bytes of files by path, with archives unpacked, and lines about what was not read. */
export async function contents(found) {
    const files = new Map(), lines = [];
    let sum = 0;
    const put = (path, bytes, whole) => {
        const before = files.get(path);
        if (before && !areEqual(before, bytes)) {
            lines.push(`warning: ${whole} is not read: another file with the path ${path} was opened with it\n  = help: rename one of them`);
        } else if (parts(path)[0] === '.page') {
            lines.push(`warning: ${whole} is not read: the page has files of its own in the folder .page\n  = help: rename the folder`);
        } else if (!NOTES.test(path)) {
            files.set(path, bytes);
        }
    };
    for (const [path, file] of found) {
        sum += file.size;
        if (sum > MOST_BYTES) {
            throw new Error('the files have more than 1 GB');
        }
        const bytes = new Uint8Array(await file.arrayBuffer());
        if (!/\.zip$/i.test(path)) {
            put(path, bytes, path);
            continue;
        }
        try {
            const inside = await unzipped(bytes, path);
            inside.files.forEach(([name, content]) => put(name, content, `${name} in ${path}`));
            lines.push(...inside.lines);
        } catch (error) {
            const why = error instanceof RangeError ? 'it is damaged' : error.message;
            lines.push(`error: ${path} cannot be unpacked: ${why}`);
        }
    }
    return { files, lines };
}

/** Says what each file is for. */
export function sorted(files) {
    const kinds = { scenes: [], lenses: [], cameras: [], pictures: [], others: [] };
    for (const [path, bytes] of files) {
        if (isCamera(bytes)) {
            kinds.cameras.push(path);
        } else if (isScene(path, bytes)) {
            kinds.scenes.push(path);
        } else if (PICTURE.test(path)) {
            kinds.pictures.push(path);
        } else if (isLens(path, bytes)) {
            kinds.lenses.push(path);
        } else {
            kinds.others.push(path);
        }
    }
    // A camera alone with nothing else to see is a scene to open.
    const ranks = ranked(kinds.scenes, files);
    kinds.scenes.sort((a, b) => ranks.get(a) - ranks.get(b) || a.localeCompare(b));
    return kinds;
}

/** How unlikely each file is the scene that is meant: a deep one, or one that others include. */
function ranked(scenes, files) {
    const nameOf = (path) => path.split('/').at(-1);
    const names = new Set(scenes.map(nameOf));
    const counts = new Map();
    const ownNames = new Set();
    for (const path of scenes) {
        for (const word of new Set(head(files.get(path)).split('"'))) {
            if (names.has(word)) {
                counts.set(word, (counts.get(word) ?? 0) + 1);
            }
            if (word === nameOf(path)) {
                ownNames.add(path);
            }
        }
    }
    const rank = (path) => {
        const parts = path.split('/');
        const isNamedByOthers = (counts.get(parts.at(-1)) ?? 0) > (ownNames.has(path) ? 1 : 0);
        return 4 * parts.length + 2 * isNamedByOthers - (parts.at(-1).replace(SCENE, '') === parts.at(-2));
    };
    return new Map(scenes.map((path) => [path, rank(path)]));
}
