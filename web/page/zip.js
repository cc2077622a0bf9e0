// Reads the files of a .zip archive, stored or deflated, of bounded size.

const MOST_FILES = 20_000;
const MOST_BYTES = 1 << 30;

async function inflated(bytes, size) {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
    const out = new Uint8Array(size);
    let at = 0;
    for await (const chunk of chunks(stream.getReader())) {
        if (at + chunk.length > size) {
            throw new Error('a file is larger than the archive says');
        }
        out.set(chunk, at);
        at += chunk.length;
    }
    if (at !== size) {
        throw new Error('a file is shorter than the archive says');
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

/** Returns the names and bytes of the files of an archive, and the names of those it cannot read. */
export async function unzipped(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    let [at, count] = directory(view);
    if (count > MOST_FILES) {
        throw new Error(`it has more than ${MOST_FILES} files`);
    }
    const files = [], unread = [];
    let sum = 0;
    for (; count > 0; count--) {
        if (view.getUint32(at, true) !== 0x0201_4b50) {
            throw new Error('its directory is damaged');
        }
        const [flags, method] = [view.getUint16(at + 8, true), view.getUint16(at + 10, true)];
        const [packed, size] = [view.getUint32(at + 20, true), view.getUint32(at + 24, true)];
        const [name, extra, comment] = [28, 30, 32].map((i) => view.getUint16(at + i, true));
        const start = view.getUint32(at + 42, true);
        const path = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + name));
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
            unread.push(path);
        } else {
            files.push([path, method === 0 ? content.slice() : await inflated(content, size)]);
        }
    }
    return { files, unread };
}
