// One instance of the program. It does one job at a time, and forgets everything when it is ended.

import { Exit, System, Tree } from './files.js';

const tree = new Tree();
const streams = ['', '', ''];
const decoders = [1, 2].map(() => new TextDecoder());
const system = new System(tree, (stream, bytes) => {
    // A hostile file could print without end.
    if (streams[stream].length < 1 << 22) {
        streams[stream] += decoders[stream - 1].decode(bytes, { stream: true });
    }
});
let program;

/** Hands the words of a command line to the program. */
function say(words) {
    tree.write('/.page/words', new TextEncoder().encode(words.join('\0')));
}

/** Returns a file that the program wrote, in memory of its own. */
function taken(path) {
    return tree.read(path)?.slice();
}

/** Writes the camera of a command line, if it is not the scene's. */
function place(camera) {
    if (camera) {
        tree.write(camera.path, new TextEncoder().encode(camera.text));
    }
}

function answer() {
    const bytes = tree.read('/.page/answer');
    return bytes && JSON.parse(new TextDecoder().decode(bytes));
}

const jobs = {
    async start({ module }) {
        program = await system.start(module);
        tree.write('/.page/parts/none', new Uint8Array(0));
        return { code: 0 };
    },
    files({ files }) {
        for (const name of [...tree.root.entries.keys()]) {
            if (name !== '.page') {
                tree.root.entries.delete(name);
            }
        }
        files.forEach(([path, bytes]) => tree.write(path, bytes));
        return { code: 0 };
    },
    /** Runs a command, and returns the files that it wrote below a folder. */
    run({ words, outputs = [], inputs = [] }) {
        inputs.forEach(([path, bytes]) => tree.write(path, bytes));
        outputs.forEach((path) => tree.remove(path));
        say(words);
        const code = program.ivcam_run();
        const files = outputs.map((path) => taken(path));
        outputs.forEach((path) => tree.remove(path));
        return { code, files };
    },
    open({ words, camera }) {
        place(camera);
        say(words);
        const code = program.ivcam_open();
        return { code, answer: code === 0 ? answer() : undefined };
    },
    preview({ words, camera, divisor }) {
        place(camera);
        say(words);
        const code = program.ivcam_preview(divisor);
        return { code, answer: code === 0 ? answer() : undefined, pixels: taken('/.page/pixels') };
    },
    expose({ region, samples, sums }) {
        tree.write('/.page/sums', sums ?? new Uint8Array(0));
        const code = program.ivcam_expose(...region, samples);
        const result = { code, sums: taken('/.page/sums'), pixels: taken('/.page/pixels') };
        tree.write('/.page/sums', new Uint8Array(0));
        return result;
    },
    join({ parts }) {
        parts.forEach((sums, i) => tree.write(`/.page/parts/${i}`, sums));
        const code = program.ivcam_join(parts.length);
        parts.forEach((_, i) => tree.remove(`/.page/parts/${i}`));
        return { code, answer: code === 0 ? answer() : undefined, pixels: taken('/.page/pixels') };
    },
    save({ path }) {
        say([path]);
        const code = program.ivcam_save();
        const bytes = taken(path);
        tree.remove(path);
        return { code, bytes };
    },
    section({ x, y, width, height }) {
        const code = program.ivcam_section(x, y, width, height);
        return { code, bytes: code === 0 ? taken('/.page/answer') : undefined };
    },
    distance({ x, y }) {
        return { code: 0, distance: program.ivcam_distance(x, y) };
    },
};

async function answerTo({ data }) {
    streams.fill('');
    let result;
    try {
        result = await jobs[data.job](data);
    } catch (error) {
        // A trap leaves the program's memory in an unknown state: the page ends this worker.
        const isExit = error instanceof Exit;
        result = { code: 2, broken: isExit ? undefined : String(error) };
    }
    result = { ...result, id: data.id, out: streams[1], messages: streams[2] };
    const buffers = [result.sums, result.pixels, result.bytes, ...result.files ?? []];
    postMessage(result, buffers.filter((bytes) => bytes?.length).map((bytes) => bytes.buffer));
}

let last = Promise.resolve();
onmessage = (event) => {
    last = last.then(() => answerTo(event));
};
