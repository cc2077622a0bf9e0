// The page: what a person chooses becomes the words of a command line, and the picture of those words
// is shown while it grows. Texts of files only ever become text.

import { Crew } from './crew.js';
import { chosen, contents, dropped, sorted } from './opened.js';
import { askedScene, published } from './published.js';
import { moved, orbited, posed } from './turns.js';

const $ = (id) => document.getElementById(id);
const fields = ['efl', 'aperture', 'focus', 'exposure', 'response', 'film', 'size', 'samples', 'shading',
    'studio', 'headlight', 'view', 'more'];
const PREVIEW = 3;
const LENS = 'nikkor-28';
const STOPS = [1.4, 2, 2.8, 4, 5.6, 8, 11, 16, 22, 32];

const state = {
    /** The files by path, from the root of the program's folder. */
    files: new Map(),
    scenes: [],
    scene: undefined,
    lenses: [],
    lens: LENS,
    /** The camera file in use, if it is not the scene's own. */
    camera: undefined,
    /** What the program says about the open photograph. */
    answer: undefined,
    exposure: undefined,
    old: undefined,
    /** Whether the focal length is still to be that of the scene's camera. */
    fits: false,
    notes: [],
    started: 0,
};
let crew;

// The words of the command line.

const value = (id) => $(id).value.trim();

function lensWords() {
    const words = ['--lens', state.lens];
    const add = (option, text) => text && words.push(option, text);
    if (state.lens !== 'none') {
        add('--efl', value('efl') && `${value('efl')}mm`);
        add('--aperture', value('aperture') && `f/${value('aperture')}`);
    }
    add('--focus', value('focus') && `${value('focus')}m`);
    return words;
}

function filmOf(width) {
    const [across, down] = (value('film') || '36x24').split('x').map(Number);
    const wide = across >= down ? width : Math.round(width * across / down);
    return [wide, Math.round(wide * down / across)];
}

/** The name of the page's camera file, which no opened file has. */
function cameraName() {
    let name = 'page-camera.iv';
    for (let i = 2; state.files.has(name); i++) {
        name = `page-camera-${i}.iv`;
    }
    return name;
}

/** The camera file in use for the program, or undefined. */
const camera = () => (state.camera === undefined ? undefined : { path: cameraName(), text: state.camera });

/** The words that change the picture. */
function words() {
    const all = ['ivcam', 'render', state.scene, ...lensWords()];
    const add = (option, text) => text && all.push(option, text);
    if (state.camera !== undefined) {
        all.push('--camera', cameraName());
    } else if (value('view').startsWith('bind ')) {
        all.push('--event', `${value('view').slice(5)}.set_bind=TRUE@0s`);
    } else {
        add('--view', value('view'));
    }
    const stops = Number(value('exposure'));
    add('--exposure', stops !== 0 && String(Number((2 ** stops).toPrecision(4))));
    add('--response', value('response'));
    add('--film', value('film'));
    const size = filmOf(Number(value('size'))).join('x');
    add('--size', size !== '360x240' && size);
    add('--shading', value('shading'));
    if ($('studio').checked) {
        all.push('--studio');
    }
    add('--headlight', value('headlight'));
    add('--samples', value('samples') !== '16' && value('samples'));
    if (state.files.size > 1) {
        all.push('--contain', '.');
    }
    all.push(...split(value('more')), '--arithmetic', 'portable');
    return all;
}

function showStops() {
    const stops = Number(value('exposure'));
    $('stops').textContent = `${stops > 0 ? '+' : ''}${stops.toFixed(1)}`;
}

/** Splits a line into words as a shell does: blanks, and quotes of both kinds. */
function split(line) {
    const found = line.match(/(?:[^\s"']+|"[^"]*"|'[^']*')+/g) ?? [];
    return found.map((word) => word.replace(/"([^"]*)"|'([^']*)'/g, '$1$2'));
}

const quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

function pictureName(end) {
    return `${state.scene.split('/').at(-1).replace(/\.[^.]*$/, '')}.${end}`;
}

// Messages.

function showMessages(text) {
    const lines = [...state.notes, text].join('\n').trim();
    const errors = (lines.match(/^error/gm) ?? []).length;
    const damaged = (lines.match(/^damaged/gm) ?? []).length;
    const warnings = (lines.match(/^warning/gm) ?? []).length;
    $('messages').textContent = lines || 'none';
    const counted = (n, word) => n > 0 && `${n} ${word}${n > 1 ? 's' : ''}`;
    const counts = [counted(errors, 'error'), counted(damaged, 'damaged place'), counted(warnings, 'warning')];
    const count = counts.filter(Boolean).join(', ');
    $('count').textContent = count && `(${count})`;
    const isBad = errors + damaged > 0;
    $('count').className = isBad ? 'bad' : '';
    if (isBad) {
        $('messages-box').open = true;
    }
}

/** The time of the last line for screen readers, in milliseconds. */
let spoken = 0;

/** Shows a line below the picture. Screen readers get progress every ten seconds, the rest at once. */
function say(text, isBad = false, isProgress = false) {
    $('status').textContent = text;
    $('status').className = isBad ? 'bad' : '';
    if (!isProgress || performance.now() - spoken > 10_000) {
        spoken = performance.now();
        $('spoken').textContent = text;
    }
}

// The picture.

function paint(pixels, [width, height], y = 0) {
    const image = new ImageData(new Uint8ClampedArray(pixels.buffer, 0, 4 * width * height), width, height);
    $('picture').getContext('2d').putImageData(image, 0, y);
}

function sized(width, height) {
    const canvas = $('picture');
    if (canvas.width !== width || canvas.height !== height) {
        Object.assign(canvas, { width, height });
    }
}

/** Shows a small picture over the whole canvas. */
async function showPreview({ answer: [width, height], pixels }) {
    const canvas = $('picture');
    const image = new ImageData(new Uint8ClampedArray(pixels.buffer, 0, 4 * width * height), width, height);
    const small = await createImageBitmap(image);
    canvas.getContext('2d').drawImage(small, 0, 0, canvas.width, canvas.height);
    document.body.dataset.preview = Math.round(performance.now() - state.started);
}

const percent = (share) => `${(100 * share).toPrecision(2)}%`;

/** What is known of a picture that has a number of samples per pixel. */
function described(exposure, samples) {
    const report = exposure.report?.report;
    const seconds = ((performance.now() - state.started) / 1000).toFixed(1);
    const error = report?.relative_rmse != null ? `error ${percent(report.relative_rmse)}`
        : report?.error_unknown ? `error unknown: ${report.error_unknown}` : 'error not yet known';
    return `${samples} of ${exposure.samples} samples, ${error}, ${seconds} s`;
}

function showState(exposure, isProgress = false) {
    const sum = exposure.bands.reduce((n, band) => n + band.done, 0);
    $('progress').value = sum / (exposure.samples * exposure.bands.length);
    say(`${exposure.isFinished ? '' : '… '}${described(exposure, exposure.done)}`, false, isProgress);
}

const on = {
    opened(result, exposure) {
        state.answer = result.answer;
        state.exposure = exposure;
        sized(exposure.width, exposure.height);
        $('empty').hidden = true;
        state.said = result.messages;
        showMessages(result.messages);
        showView(result.answer);
        showState(exposure);
        if (state.fits && refit(result)) {
            return;
        }
        state.fits = false;
        showSection();
    },
    pixels(band, pixels, exposure) {
        paint(pixels, [exposure.width, band.region[3]], band.y);
        if (exposure.done >= 1 && !document.body.dataset.first) {
            document.body.dataset.first = Math.round(performance.now() - state.started);
        }
        showState(exposure, true);
    },
    joined(result, exposure) {
        if (result.messages) {
            showMessages(`${state.said}${result.messages}`);
        }
        paint(result.pixels, [exposure.width, exposure.height]);
        showState(exposure, true);
        enableSaves(true);
    },
    failed(result) {
        const { broken } = result;
        const why = broken ? `error: the program ended: ${broken}\n  = help: another scene can be opened; the program without a browser has more memory and no limit on time\n` : '';
        showMessages(`${why}${result.messages}${result.out}`);
        say(broken ? `This scene ended its worker: ${broken}` : 'This is no picture: see the messages.', true);
        $('progress').value = 0;
        $('stop').disabled = true;
        document.body.dataset.finished = 'failed';
    },
    finished(exposure) {
        showState(exposure);
        $('stop').disabled = true;
        document.body.dataset.finished = 'yes';
    },
};

/** Gives the lens the view of the scene's own camera, if the program says that they differ. */
function refit({ messages }) {
    const sees = messages.match(/`--efl ([\d.]+)mm` shows what the camera sees/);
    state.fits = false;
    if (!sees || value('efl')) {
        return false;
    }
    $('efl').value = sees[1];
    make();
    return true;
}

/** Drops the picture, and begins the time of another. */
function begin() {
    state.started = performance.now();
    ['finished', 'first'].forEach((name) => delete document.body.dataset[name]);
    $('stop').disabled = false;
    state.exposure = undefined;
    enableSaves(false);
    const all = words();
    showCommand(all);
    return all;
}

let waiting;

/** Makes the picture again. */
function make() {
    clearTimeout(waiting);
    if (state.scene) {
        crew.photographs(begin(), camera(), on);
    }
}

/** Shows at once what a change does, and makes the picture when the controls rest for a moment. */
function change(ms = 300) {
    if (state.scene) {
        delete document.body.dataset.preview;
        crew.glances(begin(), camera(), PREVIEW, showPreview);
        clearTimeout(waiting);
        waiting = setTimeout(make, ms);
    }
}

async function stop() {
    clearTimeout(waiting);
    crew.stop();
    crew.hands.forEach((hand) => hand.isBusy && !hand.run && hand.fail('stopped'));
    $('stop').disabled = true;
    say('Stopped.');
    const { exposure } = state;
    while (exposure?.isJoining) {
        await exposure.changed();
    }
    if (exposure?.joined > 0 && exposure === state.exposure) {
        // The picture that can be saved, which bands may be ahead of.
        paint(exposure.pixels, [exposure.width, exposure.height]);
        say(`Stopped: ${described(exposure, exposure.joined)}`);
        enableSaves(true);
    }
}

function showCommand(all) {
    const line = [...all, '-o', pictureName('png')].map(quoted).join(' ');
    $('command').textContent = line;
    $('copy-camera').hidden = state.camera === undefined;
}

async function copyCommand() {
    try {
        await navigator.clipboard.writeText($('command').textContent);
    } catch {
        // Browsers give the clipboard to pages of https and of this device alone.
        getSelection().selectAllChildren($('command'));
        if (!document.execCommand('copy')) {
            say('The browser does not let this page copy: the line is selected.');
        }
    }
}

// The scene.

function setScene(path, focus = '') {
    state.scene = path;
    state.camera = undefined;
    state.answer = undefined;
    $('focus').value = focus;
    $('view').value = '';
    showScenes();
    make();
}

function option(value, text = value) {
    return Object.assign(document.createElement('option'), { value, textContent: text });
}

function group(label, options) {
    const element = Object.assign(document.createElement('optgroup'), { label });
    element.append(...options);
    return element;
}

let shipped = [];
function showScenes() {
    const own = state.scenes.map((path) => option(path, path));
    const list = [group('With the page', shipped.map(({ title }, i) => option(`shipped ${i}`, title)))];
    if (!state.isShipped && own.length > 0) {
        list.unshift(group('Opened', own));
    }
    $('scenes').replaceChildren(...list);
    $('scenes').value = state.isShipped ? `shipped ${state.isShipped - 1}` : state.scene;
}

/** The numbers of the last opening that was begun and of the one whose scene is open, from 1. */
let begun = 0, shown = 0;
/** Ends with the openings that were begun. */
let earlier = Promise.resolve();

/**
 * Opens what `load` resolves to: `show` shows it, and `isScene` says whether it replaces the
 * scene. Nothing replaces a scene that was chosen later, and what goes beside a scene waits for the
 * openings before it.
 * `about` is said meanwhile, and `fail` gets the error of `load`.
 */
async function opens(about, load, fail) {
    const turn = ++begun;
    const before = earlier;
    say(document.body.dataset.ready ? about : 'Loading the program…');
    const run = async () => {
        const { isScene, show } = await load();
        const broken = await program;
        if (!isScene) {
            await before;
        }
        if (turn < shown) {
            return;
        }
        if (broken) {
            say(broken, true);
            return;
        }
        shown = isScene ? turn : shown;
        show();
    };
    const done = run().catch((error) => turn >= shown && fail(error));
    earlier = Promise.all([before, done]);
    await done;
}

/** Opens a shipped scene by its number from 0, or the one that is nearest to it. */
function openShipped(number) {
    const read = async (path) => {
        const answer = await fetch(new URL(`scenes/${path}`, import.meta.url));
        if (!answer.ok) {
            throw new Error(`${path} cannot be loaded`);
        }
        return [path, new Uint8Array(await answer.arrayBuffer())];
    };
    const load = async () => {
        const all = await list;
        const i = Math.min(Math.max(number, 0), all.length - 1);
        const files = new Map(await Promise.all(all[i].files.map(read)));
        return { isScene: true, show: () => showShipped(i, files) };
    };
    return opens('Loading the scene…', load, (error) => say(String(error.message), true));
}

function showShipped(i, files) {
    const { scene, set } = shipped[i];
    state.files = files;
    state.isShipped = i + 1;
    state.scenes = [scene];
    forgetOpened();
    state.notes = [];
    state.fits = !set.efl;
    for (const id of ['efl', 'aperture', 'response', 'film', 'shading', 'headlight', 'more']) {
        $(id).value = set[id] ?? '';
    }
    $('studio').checked = set.studio ?? false;
    $('exposure').value = set.exposure ?? 0;
    showStops();
    chooseLens(set.lens ?? state.lens);
    giveFiles();
    setScene(scene, set.focus);
}

function giveFiles() {
    crew.setFiles([...state.files]);
}

/** Takes files in place of those before, with the controls as for a new scene. */
function replaceFiles(files, scenes) {
    Object.assign(state, { files, scenes, isShipped: 0, fits: true });
    forgetOpened();
    for (const id of ['efl', 'aperture', 'response', 'film', 'shading', 'headlight', 'more', 'search']) {
        $(id).value = '';
    }
    $('exposure').value = 0;
    $('studio').checked = false;
    showStops();
    chooseLens(state.lens);
}

/** Forgets the old picture and the lenses that were opened beside another scene. */
function forgetOpened() {
    state.old = undefined;
    $('compare-box').hidden = true;
    if (state.ownLenses?.includes(state.lens)) {
        state.lens = LENS;
    }
    state.ownLenses = undefined;
    listLenses();
}

/** Opens the scene that the address of the page names. */
function openPublished(asked) {
    const load = async () => {
        const read = await published(asked, location.href);
        const show = () => {
            const others = sorted(read.files).scenes.filter((path) => path !== read.scene);
            replaceFiles(read.files, [read.scene, ...others]);
            state.notes = read.lines;
            giveFiles();
            setScene(read.scene);
        };
        return { isScene: true, show };
    };
    return opens('Loading the scene…', load, (error) => {
        showMessages(`error: ${asked.scene} cannot be opened: ${error.message}`);
        say(`The scene cannot be opened: ${error.message}`, true);
        document.body.dataset.finished = 'failed';
    });
}

/** Opens files, or what a promise of them resolves to. */
function openFiles(found) {
    const load = async () => {
        const all = await found;
        const read = await contents(all);
        const isScene = sorted(read.files).scenes.length > 0;
        return { isScene, show: () => showFiles(isScene ? read : besideScene(read), all.length) };
    };
    return opens('Reading the files…', load, (error) => say(`The files cannot be read: ${error.message}`, true));
}

/** Puts files into the folder of the open scene, whose parts name them from there. */
function besideScene({ files, lines }) {
    const folder = (state.scene ?? '').split('/').slice(0, -1);
    const place = (path) => {
        // A folder that was opened with the scene is opened again with its own place.
        const isWhole = folder.length > 0 && path.startsWith(`${folder[0]}/`);
        return isWhole ? path : [...folder, path].join('/');
    };
    return { files: new Map([...files].map(([path, bytes]) => [place(path), bytes])), lines };
}

/** Shows opened files: a scene replaces all files, anything else goes beside the scene. */
function showFiles(read, count) {
    const kinds = sorted(read.files);
    const hasScene = kinds.scenes.length > 0;
    if (hasScene) {
        replaceFiles(read.files, kinds.scenes);
    } else {
        read.files.forEach((bytes, path) => state.files.set(path, bytes));
    }
    state.notes = read.lines;
    if (!hasScene && kinds.others.length > 0) {
        const [path, ...more] = kinds.others;
        const all = more.length > 0 ? `${path} and ${more.length} more are` : `${path} is`;
        state.notes.push(`warning: ${all} no scene, lens, camera or picture that is read\n  = help: the open scene can name such a file beside it`);
    }
    giveFiles();
    if (kinds.lenses.length > 0 && (!hasScene || count <= 3)) {
        listLenses(kinds.lenses);
        chooseLens(kinds.lenses[0]);
    }
    if (!hasScene && kinds.pictures.length === 1) {
        showOld(kinds.pictures[0]);
    }
    if (hasScene) {
        setScene(kinds.scenes[0]);
    } else if (state.scene && read.files.size > 0) {
        if (kinds.cameras.length > 0) {
            state.camera = new TextDecoder().decode(read.files.get(kinds.cameras[0]));
        }
        make();
    } else {
        showMessages(read.files.size > 0 ? 'error: none of these files is a scene that can be opened' : '');
        say('No scene was found.', true);
    }
}

// Lenses.

function listLenses(own = []) {
    const wanted = value('search').toLowerCase().split(/\s+/).filter(Boolean);
    const fits = (text) => wanted.every((word) => text.toLowerCase().includes(word));
    const groups = [];
    if (own.length > 0) {
        state.ownLenses = [...new Set([...own, ...state.ownLenses ?? []])];
    }
    if (state.ownLenses?.length > 0) {
        groups.push(group('opened', state.ownLenses.map((path) => option(path))));
    }
    const plain = [['none', 'pinhole: no lens'], ['ideal', 'ideal lens, without faults']];
    groups.push(group('without glass', plain.filter(([, text]) => fits(text)).map(([v, t]) => option(v, t))));
    const kinds = Map.groupBy ? Map.groupBy(state.lenses, (lens) => lens.kind) : groupedBy(state.lenses);
    for (const [kind, lenses] of kinds) {
        const shown = lenses.filter((l) => fits(`${l.name} ${l.title} ${l.kind} ${l.year} ${l.source}`));
        const line = (l) => `${l.name} · f/${l.f_number.toFixed(1)} · ${/^\d/.test(l.year ?? '') ? l.year : ''}`;
        groups.push(group(kind, shown.map((l) => Object.assign(option(l.name, line(l)), { title: l.title }))));
    }
    $('lens').replaceChildren(...groups.filter((g) => g.children.length > 0));
    $('lens').value = state.lens;
}

function groupedBy(lenses) {
    const kinds = new Map();
    lenses.forEach((lens) => kinds.set(lens.kind, [...kinds.get(lens.kind) ?? [], lens]));
    return kinds;
}

function chooseLens(name) {
    state.lens = name;
    const known = state.lenses.find((lens) => lens.name === name);
    $('lens').value = name;
    const before = value('aperture');
    const fastest = known?.f_number ?? 0;
    const stops = STOPS.filter((stop) => stop > fastest);
    const full = known ? `full, ${fastest.toFixed(1)}` : 'full';
    $('aperture').replaceChildren(option('', full), ...stops.map((stop) => option(String(stop))));
    $('aperture').value = stops.some((stop) => String(stop) === before) ? before : '';
    $('efl').placeholder = known ? known.efl.toFixed(1) : '';
    $('efl').disabled = $('aperture').disabled = name === 'none';
    $('lens-about').textContent = known ? `${known.title}, ${known.year ?? ''}. ${known.source ?? ''}` : '';
}

let pointed = [0.5, 0.5];
let isDrawing = false;

/** A worker with an open photograph. */
const opened = () => crew?.hands.find((hand) => hand.run !== undefined && !hand.stale);

/** Draws the section of the lens with rays of the pixel under the pointer. */
async function showSection() {
    const hand = opened();
    if (!$('section-box').open || isDrawing || !hand) {
        return;
    }
    isDrawing = true;
    const [x, y] = pointed;
    const width = Math.max(320, $('section-box').clientWidth - 40);
    const { bytes } = await hand.does({ job: 'section', x, y, width, height: Math.min(260, 0.5 * width) });
    isDrawing = false;
    const image = $('section');
    image.hidden = !bytes;
    if (bytes) {
        URL.revokeObjectURL(image.src);
        image.src = URL.createObjectURL(new Blob([bytes], { type: 'image/svg+xml' }));
        image.alt = `Section of the lens ${state.lens} with rays of one pixel`;
    }
    if (pointed[0] !== x || pointed[1] !== y) {
        showSection();
    }
}

// The camera.

/** The camera in use as a pose. */
function pose() {
    const { position, orientation } = state.answer;
    return { position, orientation };
}

function focusDistance() {
    return Number(value('focus')) || state.answer?.['focal distance'] || 3;
}

function setPose(next) {
    Object.assign(state.answer, next);
    state.camera = posed(state.answer.camera, next);
    change();
}

/** Moves the camera: `turn` in radians to the right and up, `shift` in parts of the distance. */
function moveCamera({ turn, shift }) {
    if (!state.answer?.camera) {
        return;
    }
    const distance = focusDistance();
    if (turn) {
        setPose(orbited(pose(), distance, ...turn));
    } else {
        setPose(moved(pose(), shift.map((s) => s * distance)));
    }
}

function setFocus(meters) {
    if (meters > 0 && Number.isFinite(meters)) {
        $('focus').value = String(Number(meters.toPrecision(4)));
        change();
    }
}

/** Focuses on what is visible at a place of the picture, from 0 to 1. */
async function focusAt(x, y) {
    const { distance } = await opened()?.does({ job: 'distance', x, y }) ?? {};
    if (distance > 0) {
        setFocus(distance);
    } else if (distance === undefined) {
        say('The scene is not open yet: focus when its picture grows.');
    } else {
        say('Nothing is there to focus on.');
    }
}

function goHome() {
    state.camera = undefined;
    $('view').value = '';
    make();
}

function showView({ viewpoints }) {
    const before = value('view');
    const sides = ['front', 'three-quarter', 'left', 'right', 'back', 'top', 'bottom', 'standard'];
    const groups = [option('', 'the scene’s own camera')];
    if (viewpoints.length > 0) {
        groups.push(group('viewpoints', viewpoints.map(([name, text]) => option(`bind ${name}`, text))));
    }
    groups.push(group('sides, the whole scene', sides.map((side) => option(side))));
    $('view').replaceChildren(...groups);
    $('view').value = before;
    if ($('view').selectedIndex < 0) {
        $('view').value = '';
    }
}

// The pointer and the keys over the picture.

const pointers = new Map();
let travelled = 0;

/** The place of an event in the picture, from 0 to 1, or undefined beside it. */
function placeOf(event) {
    const canvas = $('picture');
    const box = canvas.getBoundingClientRect();
    const scale = Math.min(box.width / canvas.width, box.height / canvas.height);
    const [width, height] = [canvas.width * scale, canvas.height * scale];
    const x = (event.clientX - box.left - (box.width - width) / 2) / width;
    const y = (event.clientY - box.top - (box.height - height) / 2) / height;
    return x >= 0 && x < 1 && y >= 0 && y < 1 ? [x, y] : undefined;
}

function pointerMoved(event) {
    const before = pointers.get(event.pointerId);
    if (!before) {
        pointed = placeOf(event) ?? [0.5, 0.5];
        showSection();
        return;
    }
    const spread = () => {
        const [a, b] = [...pointers.values()];
        return Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
    };
    const wide = pointers.size === 2 ? spread() : 0;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    pointers.set(event.pointerId, event);
    travelled += Math.hypot(dx, dy);
    if (travelled < 6) {
        return;
    }
    const size = $('picture').getBoundingClientRect().width;
    if (pointers.size === 2) {
        const closer = 1 - wide / Math.max(spread(), 1);
        moveCamera({ shift: [-0.5 * dx / size, 0.5 * dy / size, -closer] });
    } else if (event.shiftKey || event.buttons & 4) {
        moveCamera({ shift: [-dx / size, dy / size, 0] });
    } else if (event.ctrlKey || event.buttons & 2) {
        moveCamera({ shift: [0, 0, dy / size] });
    } else {
        moveCamera({ turn: [-2.5 * dx / size, -2.5 * dy / size] });
    }
}

function watchPointer() {
    const canvas = $('picture');
    canvas.addEventListener('pointerdown', (event) => {
        canvas.setPointerCapture(event.pointerId);
        travelled = pointers.size === 0 ? 0 : 99;
        pointers.set(event.pointerId, event);
    });
    canvas.addEventListener('pointermove', pointerMoved);
    const end = (event) => {
        const wasDown = pointers.delete(event.pointerId);
        const place = placeOf(event);
        if (wasDown && event.type === 'pointerup' && travelled < 6 && place) {
            focusAt(...place);
        }
    };
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('wheel', (event) => {
        event.preventDefault();
        setFocus(focusDistance() * 1.04 ** -Math.sign(event.deltaY));
    }, { passive: false });
    canvas.addEventListener('keydown', (event) => {
        const act = keyed(event);
        if (act) {
            event.preventDefault();
            act();
        }
    });
}

/** What a key does over the picture. */
function keyed({ key, shiftKey, ctrlKey, altKey, metaKey }) {
    if (ctrlKey || altKey || metaKey) {
        return undefined;
    }
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
    if (arrows) {
        const [x, y] = arrows;
        return () => moveCamera(shiftKey ? { shift: [0.05 * x, 0.05 * y, 0] } : { turn: [0.08 * x, -0.08 * y] });
    }
    return {
        '+': () => moveCamera({ shift: [0, 0, -0.08] }),
        '=': () => moveCamera({ shift: [0, 0, -0.08] }),
        '-': () => moveCamera({ shift: [0, 0, 0.08] }),
        ']': () => setFocus(focusDistance() * 1.08),
        '[': () => setFocus(focusDistance() / 1.08),
        Enter: () => focusAt(0.5, 0.5),
        Home: goHome,
    }[key];
}

// What is saved.

const outputs = [
    ['Picture .png', 'png'], ['Exposure .exr', 'exr'],
    ['glTF .glb', 'glb'], ['X3D', 'x3d'], ['VRML97', 'wrl', 'vrml97'], ['Inventor', 'iv', 'inventor'],
    ['Losses of glTF', 'losses.json'], ['Lens data', 'lens.html'], ['Report', 'report.json'],
];

function download(bytes, name, type = 'application/octet-stream') {
    const address = URL.createObjectURL(new Blob([bytes], { type }));
    Object.assign(document.createElement('a'), { href: address, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(address), 10_000);
    $('saved').textContent = `${name}: ${bytes.length.toLocaleString('en')} bytes`;
    $('saved').className = 'note';
}

function refused(text) {
    $('saved').textContent = text;
    $('saved').className = 'note bad';
}

/** The bytes of the picture as a file, or undefined. */
async function pictureFile(end) {
    const holder = state.exposure?.holder;
    if (!holder || holder.run === undefined) {
        return undefined;
    }
    return (await holder.does({ job: 'save', path: `/.page/${pictureName(end)}` })).bytes;
}

async function save(end, target) {
    if (!state.scene) {
        return refused('No scene is open yet.');
    }
    $('saved').textContent = 'Working…';
    if (end === 'png' || end === 'exr') {
        const bytes = await pictureFile(end);
        return bytes ? download(bytes, pictureName(end)) : refused('The picture is not there yet.');
    }
    if (end === 'report.json') {
        const { report, joinedAt } = state.exposure ?? {};
        const own = { picture: pictureName('png'), total_seconds: (joinedAt - state.started) / 1000 };
        const text = JSON.stringify({ ...report?.report, ...own }, null, 2);
        return download(new TextEncoder().encode(text), pictureName(end));
    }
    const isLens = end === 'lens.html';
    const lens = state.answer?.['lens words'];
    if (isLens && !lens) {
        return refused(state.answer ? 'The picture is made without a prescription.' : 'The picture is not there yet.');
    }
    const isLoss = end === 'losses.json';
    const out = `/.page/saved.${isLens ? 'html' : isLoss ? 'glb' : end}`;
    const report = '/.page/losses.json';
    const contained = state.files.size > 1 ? ['--contain', '.'] : [];
    const all = isLens
        ? ['ivcam', 'lens', ...lens, '--sheet', out]
        : ['ivcam', 'convert', state.scene, ...contained, '-o', out, '--report', report,
            ...(target ? ['--to', target] : [])];
    const result = await crew.command(all, [out, report]);
    const bytes = result.files?.[isLoss ? 1 : 0];
    if (!bytes) {
        showMessages(result.messages || `error: ${result.broken}`);
        return refused('It could not be written: see the messages.');
    }
    return download(bytes, isLens ? `${lens[0].split('/').at(-1)}.html` : pictureName(end));
}

function enableSaves(areThere) {
    for (const button of $('saves').children) {
        if (['png', 'exr', 'report.json'].includes(button.dataset.end)) {
            button.disabled = !areThere;
        }
    }
}

// An old picture beside the new one.

function showOld(path) {
    state.old = path;
    $('compare-box').hidden = false;
    $('compared').textContent = '';
    URL.revokeObjectURL($('old').src);
    $('old').src = URL.createObjectURL(new Blob([state.files.get(path)]));
}

async function compare() {
    const bytes = await pictureFile('png');
    if (!bytes) {
        $('compared').textContent = 'The picture is not there yet.';
        return;
    }
    const made = '/.page/made.png';
    const inputs = [[made, bytes]];
    const result = await crew.idle.does({ job: 'run', words: ['ivcam', 'compare', made, state.old], inputs });
    $('compared').textContent = `${result.out}${result.messages}`;
}

// The start.

function listen() {
    $('panel').addEventListener('submit', (event) => event.preventDefault());
    for (const id of fields) {
        const isText = ['number', 'range', 'text'].includes($(id).type);
        $(id).addEventListener(isText ? 'input' : 'change', () => change(isText ? 350 : 50));
    }
    $('exposure').addEventListener('input', showStops);
    $('view').addEventListener('change', () => {
        state.camera = undefined;
    });
    $('search').addEventListener('input', () => listLenses());
    $('lens').addEventListener('change', () => {
        chooseLens($('lens').value);
        change(150);
    });
    $('section-box').addEventListener('toggle', showSection);
    $('scenes').addEventListener('change', () => {
        const chosenScene = value('scenes');
        if (chosenScene.startsWith('shipped ')) {
            openShipped(Number(chosenScene.slice(8)));
        } else {
            shown = ++begun;
            $('efl').value = '';
            state.fits = true;
            setScene(chosenScene);
        }
    });
    $('stop').addEventListener('click', stop);
    $('home').addEventListener('click', goHome);
    $('middle').addEventListener('click', () => focusAt(0.5, 0.5));
    $('copy').addEventListener('click', copyCommand);
    $('copy-camera').addEventListener('click', () => download(new TextEncoder().encode(state.camera), cameraName()));
    $('compare').addEventListener('click', compare);
    for (const [text, end, target] of outputs) {
        const button = Object.assign(document.createElement('button'), { type: 'button', textContent: text });
        button.dataset.end = end;
        button.addEventListener('click', () => save(end, target));
        $('saves').append(button);
    }
    enableSaves(false);
    listenForFiles();
    watchPointer();
}

function listenForFiles() {
    for (const id of ['files', 'folder']) {
        $(`choose-${id}`).addEventListener('click', () => $(id).click());
        $(id).addEventListener('change', () => {
            if ($(id).files.length > 0) {
                openFiles(chosen($(id).files));
            }
            $(id).value = '';
        });
    }
    addEventListener('dragover', (event) => {
        event.preventDefault();
        $('drop').hidden = false;
    });
    addEventListener('dragleave', (event) => {
        if (!event.relatedTarget) {
            $('drop').hidden = true;
        }
    });
    addEventListener('drop', (event) => {
        event.preventDefault();
        $('drop').hidden = true;
        if ([...event.dataTransfer.items].some(({ kind }) => kind === 'file')) {
            openFiles(dropped(event.dataTransfer));
        }
    });
}

/** The number of workers: one a core, as far as the device's memory allows. */
function count() {
    const asked = Number(new URL(location.href).searchParams.get('workers'));
    const cores = Math.max(1, navigator.hardwareConcurrency ?? 2);
    const most = (navigator.deviceMemory ?? 4) <= 2 ? 2 : 8;
    return asked >= 1 && asked <= 64 ? asked : Math.min(cores, most);
}

/** Fetches and compiles the program. */
async function compiled() {
    const answer = await fetch(new URL('ivcam.wasm', import.meta.url));
    if (!answer.ok) {
        throw new Error(`the server answers ${answer.status}`);
    }
    // Browsers compile while they load only what has this type, which some servers do not know.
    return answer.headers.get('content-type') === 'application/wasm'
        ? WebAssembly.compileStreaming(answer) : WebAssembly.compile(await answer.arrayBuffer());
}

/** Loads the program and its lenses. Returns what is wrong, if anything is. */
async function load() {
    try {
        crew = new Crew(await compiled(), count());
        shipped = await list;
        const { out } = await crew.command(['ivcam', 'lens', '--json'], []);
        state.lenses = JSON.parse(out);
    } catch (error) {
        return `The program cannot be loaded: ${error.message}`;
    }
    chooseLens(state.lens);
    listLenses();
    showView({ viewpoints: [] });
    showScenes();
    document.body.dataset.ready = 'yes';
    return undefined;
}

function start() {
    listen();
    const asked = new URL(location.href).searchParams;
    for (const id of ['samples', 'size']) {
        const known = [...$(id).options].some((o) => o.value === asked.get(id));
        $(id).value = known ? asked.get(id) : $(id).value;
    }
    const scene = askedScene(location.href);
    scene ? openPublished(scene) : openShipped(Number(asked.get('scene') ?? 1) - 1);
}

if ('serviceWorker' in navigator && location.protocol !== 'file:') {
    navigator.serviceWorker.register(new URL('offline.js', import.meta.url)).catch(() => {});
}
const list = fetch(new URL('scenes.json', import.meta.url)).then((answer) => answer.json());
const program = load();
start();
