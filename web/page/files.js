// A folder of files in memory, and WASI's calls (wasi_snapshot_preview1) for it: what the program asks
// of an operating system. There are no links, no other programs and no threads.

const OK = 0, BADF = 8, EXIST = 20, INVAL = 28, ISDIR = 31, NOENT = 44, NOSPC = 51, NOSYS = 52,
    NOTDIR = 54, NOTEMPTY = 55, SPIPE = 70;
const DEVICE = 2, FOLDER = 3, REGULAR = 4;
const CREATE = 1, MUST_BE_FOLDER = 2, EXCLUSIVE = 4, TRUNCATE = 8;
// The most that the files of one page may hold, in bytes.
const MOST = 1 << 30;

/** Ends a program that has called `exit`. */
export class Exit extends Error {
    constructor(code) {
        super(`exit code ${code}`);
        this.code = code;
    }
}

class File {
    constructor(bytes = new Uint8Array(0)) {
        this.bytes = bytes;
        this.size = bytes.length;
    }

    /** Makes room for a size, and sets it. */
    resize(size) {
        if (size > this.bytes.length) {
            const larger = new Uint8Array(Math.max(size, 2 * this.bytes.length));
            larger.set(this.bytes.subarray(0, this.size));
            this.bytes = larger;
        }
        if (size > this.size) {
            this.bytes.fill(0, this.size, size);
        }
        this.size = size;
    }

    get content() {
        return this.bytes.subarray(0, this.size);
    }
}

class Folder {
    constructor() {
        this.entries = new Map();
    }
}

/** The parts of a path, without detours. */
export function parts(path) {
    const out = [];
    for (const part of path.split('/')) {
        if (part === '..') {
            out.pop();
        } else if (part !== '' && part !== '.') {
            out.push(part);
        }
    }
    return out;
}

/** A tree of folders and files. */
export class Tree {
    constructor() {
        this.root = new Folder();
    }

    /** Returns the folder or file of a path, or undefined. */
    at(path) {
        let node = this.root;
        for (const part of parts(path)) {
            node = node instanceof Folder ? node.entries.get(part) : undefined;
        }
        return node;
    }

    /** Returns the folder around a path, and the last part. */
    place(path) {
        const all = parts(path);
        const name = all.pop();
        const folder = this.at(all.join('/'));
        return [folder instanceof Folder ? folder : undefined, name];
    }

    /** Writes a file, and the folders around it. */
    write(path, bytes) {
        const all = parts(path);
        const name = all.pop();
        let folder = this.root;
        for (const part of all) {
            if (!(folder.entries.get(part) instanceof Folder)) {
                folder.entries.set(part, new Folder());
            }
            folder = folder.entries.get(part);
        }
        folder.entries.set(name, new File(bytes));
    }

    /** Returns the bytes of a file, or undefined. */
    read(path) {
        const file = this.at(path);
        return file instanceof File ? file.content : undefined;
    }

    remove(path) {
        const [folder, name] = this.place(path);
        folder?.entries.delete(name);
    }
}

/** WASI's calls for a tree. `write(stream, bytes)` receives what goes to stdout (1) and stderr (2). */
export class System {
    constructor(tree, write) {
        this.tree = tree;
        this.write = write;
        this.memory = undefined;
        this.used = 0;
        this.open = new Map([
            [0, { device: true }], [1, { device: true }], [2, { device: true }],
            [3, { node: tree.root }],
        ]);
        this.next = 4;
        this.numbers = new WeakMap();
        this.last = 0;
    }

    view() {
        return new DataView(this.memory.buffer);
    }

    bytes(at, length) {
        return new Uint8Array(this.memory.buffer, at, length);
    }

    text(at, length) {
        return new TextDecoder().decode(this.bytes(at, length).slice());
    }

    /** The number that the program knows a file by. */
    number(node) {
        if (!this.numbers.has(node)) {
            this.numbers.set(node, ++this.last);
        }
        return BigInt(this.numbers.get(node));
    }

    /** Writes what is known about a file. */
    describe(node, at) {
        const view = this.view();
        this.bytes(at, 64).fill(0);
        const isFile = node instanceof File;
        view.setBigUint64(at + 8, node ? this.number(node) : 0n, true);
        view.setUint8(at + 16, isFile ? REGULAR : node ? FOLDER : DEVICE);
        view.setBigUint64(at + 24, 1n, true);
        view.setBigUint64(at + 32, BigInt(isFile ? node.size : 0), true);
    }

    /** Calls `each` with the buffers of a list until it returns fewer bytes than asked for. */
    scatter(list, count, done, each) {
        let sum = 0;
        for (let i = 0; i < count; i++) {
            const view = this.view();
            const length = view.getUint32(list + 8 * i + 4, true);
            const moved = each(this.bytes(view.getUint32(list + 8 * i, true), length));
            sum += moved;
            if (moved < length) {
                break;
            }
        }
        this.view().setUint32(done, sum, true);
        return OK;
    }

    read(fd, list, count, done, offset) {
        const entry = this.open.get(fd);
        if (!entry) {
            return BADF;
        }
        if (entry.device) {
            return this.scatter(list, count, done, () => 0);
        }
        if (!(entry.node instanceof File)) {
            return ISDIR;
        }
        let at = offset ?? entry.at;
        this.scatter(list, count, done, (to) => {
            const from = entry.node.content.subarray(at, at + to.length);
            to.set(from);
            at += from.length;
            return from.length;
        });
        if (offset === undefined) {
            entry.at = at;
        }
        return OK;
    }

    writeTo(fd, list, count, done, offset) {
        const entry = this.open.get(fd);
        if (!entry) {
            return BADF;
        }
        if (entry.device) {
            return this.scatter(list, count, done, (from) => {
                this.write(fd, from.slice());
                return from.length;
            });
        }
        const file = entry.node;
        if (!(file instanceof File)) {
            return ISDIR;
        }
        let at = offset ?? (entry.append ? file.size : entry.at);
        let full = false;
        this.scatter(list, count, done, (from) => {
            const more = Math.max(0, at + from.length - file.size);
            full = this.used + more > MOST;
            if (full) {
                return 0;
            }
            this.used += more;
            if (more > 0) {
                file.resize(at + from.length);
            }
            file.bytes.set(from, at);
            at += from.length;
            return from.length;
        });
        if (offset === undefined) {
            entry.at = at;
        }
        return full ? NOSPC : OK;
    }

    openPath(fd, at, length, how, flags, result) {
        const path = this.path(fd, at, length);
        if (path === undefined) {
            return NOTDIR;
        }
        let node = this.tree.at(path);
        if (node && how & CREATE && how & EXCLUSIVE) {
            return EXIST;
        }
        if (!node) {
            if (!(how & CREATE)) {
                return NOENT;
            }
            const [folder, name] = this.tree.place(path);
            if (!folder || name === undefined) {
                return NOENT;
            }
            node = new File();
            folder.entries.set(name, node);
        }
        if (how & MUST_BE_FOLDER && !(node instanceof Folder)) {
            return NOTDIR;
        }
        if (how & TRUNCATE && node instanceof File) {
            this.used -= node.size;
            node.bytes = new Uint8Array(0);
            node.size = 0;
        }
        this.open.set(this.next, { node, at: 0, append: (flags & 1) === 1, path });
        this.view().setUint32(result, this.next++, true);
        return OK;
    }

    /** The path that a call names, from the root. */
    path(fd, at, length) {
        const base = this.open.get(fd);
        return base?.node instanceof Folder ? `${base.path ?? ''}/${this.text(at, length)}` : undefined;
    }

    list(fd, at, length, cookie, done) {
        const folder = this.open.get(fd)?.node;
        if (!(folder instanceof Folder)) {
            return NOTDIR;
        }
        const to = this.bytes(at, length);
        let used = 0;
        const names = [...folder.entries.keys()].sort();
        for (let i = Number(cookie); i < names.length && used < length; i++) {
            const name = new TextEncoder().encode(names[i]);
            const node = folder.entries.get(names[i]);
            const entry = new Uint8Array(24 + name.length);
            const view = new DataView(entry.buffer);
            view.setBigUint64(0, BigInt(i + 1), true);
            view.setBigUint64(8, this.number(node), true);
            view.setUint32(16, name.length, true);
            view.setUint8(20, node instanceof Folder ? FOLDER : REGULAR);
            entry.set(name, 24);
            const fits = entry.subarray(0, length - used);
            to.set(fits, used);
            used += fits.length;
        }
        this.view().setUint32(done, used, true);
        return OK;
    }

    rename(from, to) {
        const [folder, name] = this.tree.place(from);
        const node = folder?.entries.get(name);
        const [target, newName] = this.tree.place(to);
        if (!node || !target) {
            return NOENT;
        }
        folder.entries.delete(name);
        target.entries.set(newName, node);
        return OK;
    }

    unlink(path, kind) {
        const [folder, name] = this.tree.place(path);
        const node = folder?.entries.get(name);
        if (!node) {
            return NOENT;
        }
        if (!(node instanceof kind)) {
            return node instanceof Folder ? ISDIR : NOTDIR;
        }
        if (node instanceof Folder && node.entries.size > 0) {
            return NOTEMPTY;
        }
        this.used -= node.size ?? 0;
        folder.entries.delete(name);
        return OK;
    }

    seek(fd, offset, from, result) {
        const entry = this.open.get(fd);
        if (!(entry?.node instanceof File)) {
            return entry ? SPIPE : BADF;
        }
        const base = [0, entry.at, entry.node.size][from];
        const at = base + Number(offset);
        if (at < 0) {
            return INVAL;
        }
        entry.at = at;
        this.view().setBigUint64(result, BigInt(at), true);
        return OK;
    }

    /** The functions that the program imports. */
    imports() {
        const now = (clock) => {
            const ms = clock === 0 ? Date.now() : performance.now();
            return BigInt(Math.round(ms * 1e6));
        };
        const known = {
            args_sizes_get: (count, size) => this.twoZeros(count, size),
            args_get: () => OK,
            environ_sizes_get: (count, size) => this.twoZeros(count, size),
            environ_get: () => OK,
            clock_res_get: (_, at) => (this.view().setBigUint64(at, 1000n, true), OK),
            clock_time_get: (clock, _, at) => (this.view().setBigUint64(at, now(clock), true), OK),
            fd_close: (fd) => (this.open.delete(fd) ? OK : BADF),
            fd_fdstat_get: (fd, at) => {
                const entry = this.open.get(fd);
                if (!entry) {
                    return BADF;
                }
                this.bytes(at, 24).fill(0);
                const kind = entry.device ? DEVICE : entry.node instanceof Folder ? FOLDER : REGULAR;
                this.view().setUint8(at, kind);
                // A stream that may be moved is no terminal, so messages have no colors.
                this.view().setBigUint64(at + 8, 0x1fff_ffffn, true);
                this.view().setBigUint64(at + 16, 0x1fff_ffffn, true);
                return OK;
            },
            fd_fdstat_set_flags: () => OK,
            fd_filestat_get: (fd, at) => {
                const entry = this.open.get(fd);
                return entry ? (this.describe(entry.node, at), OK) : BADF;
            },
            fd_filestat_set_size: (fd, size) => {
                const file = this.open.get(fd)?.node;
                if (!(file instanceof File) || Number(size) > MOST) {
                    return INVAL;
                }
                this.used += Number(size) - file.size;
                file.resize(Number(size));
                return OK;
            },
            fd_prestat_get: (fd, at) => {
                if (fd !== 3) {
                    return BADF;
                }
                this.view().setUint32(at, 0, true);
                this.view().setUint32(at + 4, 1, true);
                return OK;
            },
            fd_prestat_dir_name: (fd, at) => (this.bytes(at, 1).fill(0x2f), OK),
            fd_read: (fd, list, count, done) => this.read(fd, list, count, done),
            fd_pread: (fd, list, count, at, done) => this.read(fd, list, count, done, Number(at)),
            fd_write: (fd, list, count, done) => this.writeTo(fd, list, count, done),
            fd_pwrite: (fd, list, count, at, done) =>
                this.writeTo(fd, list, count, done, Number(at)),
            fd_seek: (fd, offset, from, result) => this.seek(fd, offset, from, result),
            fd_tell: (fd, result) => this.seek(fd, 0n, 1, result),
            fd_sync: () => OK,
            fd_datasync: () => OK,
            fd_readdir: (fd, at, length, cookie, done) => this.list(fd, at, length, cookie, done),
            path_open: (fd, _, at, length, how, _base, _below, flags, result) =>
                this.openPath(fd, at, length, how, flags, result),
            path_filestat_get: (fd, _, at, length, result) => {
                const node = this.tree.at(this.path(fd, at, length) ?? '');
                return node ? (this.describe(node, result), OK) : NOENT;
            },
            path_create_directory: (fd, at, length) => {
                const [folder, name] = this.tree.place(this.path(fd, at, length) ?? '');
                if (!folder || name === undefined || folder.entries.has(name)) {
                    return folder ? EXIST : NOENT;
                }
                folder.entries.set(name, new Folder());
                return OK;
            },
            path_unlink_file: (fd, at, length) => this.unlink(this.path(fd, at, length) ?? '', File),
            path_remove_directory: (fd, at, length) =>
                this.unlink(this.path(fd, at, length) ?? '', Folder),
            path_rename: (fd, at, length, toFd, to, toLength) =>
                this.rename(this.path(fd, at, length) ?? '', this.path(toFd, to, toLength) ?? ''),
            path_readlink: () => INVAL,
            poll_oneoff: (list, events, count, done) => {
                // A program that sleeps goes on at once.
                for (let i = 0; i < count; i++) {
                    this.bytes(events + 32 * i, 32).fill(0);
                    this.bytes(events + 32 * i, 8).set(this.bytes(list + 48 * i, 8));
                    this.view().setUint8(events + 32 * i + 10, this.view().getUint8(list + 48 * i + 8));
                }
                this.view().setUint32(done, count, true);
                return OK;
            },
            proc_exit: (code) => {
                throw new Exit(code);
            },
            random_get: (at, length) => {
                for (let i = 0; i < length; i += 65536) {
                    const part = new Uint8Array(Math.min(65536, length - i));
                    crypto.getRandomValues(part);
                    this.bytes(at + i, part.length).set(part);
                }
                return OK;
            },
            sched_yield: () => OK,
        };
        return known;
    }

    twoZeros(a, b) {
        this.view().setUint32(a, 0, true);
        this.view().setUint32(b, 0, true);
        return OK;
    }

    /** Instantiates a module. Calls of WASI that this page does not have fail with `ENOSYS`. */
    async start(module) {
        const wasi = this.imports();
        const all = {};
        for (const { module: from, name, kind } of WebAssembly.Module.imports(module)) {
            if (kind !== 'function') {
                continue;
            }
            all[from] ??= {};
            // Some versions of the libc ask for threads, and get none; locks of one thread are free.
            const missing = () => (from === 'env' && name !== 'pthread_create' ? OK : NOSYS);
            all[from][name] = from === 'wasi_snapshot_preview1' && wasi[name] || missing;
        }
        const instance = await WebAssembly.instantiate(module, all);
        this.memory = instance.exports.memory;
        instance.exports._initialize?.();
        return instance.exports;
    }
}
