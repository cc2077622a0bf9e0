// Reads the files of a .zip archive, stored or deflated, of bounded size.

const MOST_FILES = 20_000;
const MOST_BYTES = 1 << 30;
const HELP = '\n  = help: copy or download the archive again';

const TABLE = new Uint32Array(256).map((_, n) => {
    let c = n;
    for (let k = 0; k < 8; k++) {
        c = c & 1 ? 0xedb8_8320 ^ c >>> 1 : c >>> 1;
    }
    return c;
});

/** The CRC-32 of bytes. */
function checksum(bytes) {
    let c = -1;
    for (let i = 0; i < bytes.length; i++) {
        c = TABLE[(c ^ bytes[i]) & 255] ^ c >>> 8;
    }
    return ~c >>> 0;
}

async function inflated(bytes, size) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    const out = new Uint8Array(size);
    let at = 0;
    for await (const chunk of chunks(stream.getReader())) {
        if (at + chunk.length > size) {
            throw new Error('it is larger than the archive says');
        }
        out.set(chunk, at);
        at += chunk.length;
    }
    if (at !== size) {
        throw new Error('it is shorter than the archive says');
    }
    return out;
}

async function* chunks(reader) {
    for (;;) {
        const { done, value } = await reader.read();
        if (done) {
            return;
        }
        yield value;
    }
}

/** The place of the archive's directory. */
function directory(view) {
    const least = Math.max(0, view.byteLength - 65_557);
    for (let at = view.byteLength - 22; at >= least; at--) {
        if (view.getUint32(at, true) === 0x0605_4b50) {
            return [view.getUint32(at + 16, true), view.getUint16(at + 10, true)];
        }
    }
    throw new Error('it is not a .zip archive, or its end is missing');
}

/**
 * Returns the names and bytes of the files of an archive, and lines about those that are damaged or
 * cannot be read; `archive` is its name.
 */
export async function unzipped(bytes, archive) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let [at, count] = directory(view);
    if (count > MOST_FILES) {
        throw new Error(`it has more than ${MOST_FILES} files`);
    }
    const files = [], lines = [];
    let sum = 0;
    for (; count > 0; count--) {
        if (view.getUint32(at, true) !== 0x0201_4b50) {
            throw new Error('its directory is damaged');
        }
        const [flags, method] = [view.getUint16(at + 8, true), view.getUint16(at + 10, true)];
        const [packed, size] = [view.getUint32(at + 20, true), view.getUint32(at + 24, true)];
        const [name, extra, comment] = [28, 30, 32].map((i) => view.getUint16(at + i, true));
        const start = view.getUint32(at + 42, true);
        const stated = view.getUint32(at + 16, true);
        // Some programs separate folders as Windows does.
        const path = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + name)).replaceAll('\\', '/');
        at += 46 + name + extra + comment;
        if (path.endsWith('/')) {
            continue;
        }
        const from = start + 30 + view.getUint16(start + 26, true) + view.getUint16(start + 28, true);
        const content = bytes.subarray(from, from + packed);
        sum += size;
        if (sum > MOST_BYTES) {
            throw new Error('its files have more than 1 GB');
        }
        if (flags & 1 || (method !== 0 && method !== 8)) {
            lines.push(`warning: ${path} in ${archive} is not read: it is encrypted, or packed by another method than deflate\n  = help: unpack it, and open the folder`);
            continue;
        }
        let unpacked;
        try {
            unpacked = method === 0 ? content.slice() : await inflated(content, size);
        } catch (error) {
            lines.push(`damaged: ${path} in ${archive} is not read: ${error.message}${HELP}`);
            continue;
        }
        if (unpacked.length !== size || checksum(unpacked) !== stated) {
            lines.push(`damaged: ${path} in ${archive} is not what was packed: its checksum differs${HELP}`);
        }
        files.push([path, unpacked]);
    }
    return { files, lines };
}
