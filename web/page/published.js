// The scene that the address of the page names: `?scene=ADDRESS`, with the files that it needs from the
// list `&files=ADDRESS`. Addresses are relative to the page, and nothing of another server is fetched.

const MOST_BYTES = 1 << 30;
const MOST_FILES = 10_000;
const AT_ONCE = 6;

/** What an address asks for: the addresses of a scene and of a list, or undefined for a shipped scene. */
export function askedScene(address) {
    const { searchParams } = new URL(address);
    const scene = searchParams.get('scene');
    return !scene || /^\d+$/.test(scene) ? undefined : { scene, list: searchParams.get('files') ?? undefined };
}

/** The whole address of a file on the page's own server. */
function own(text, base) {
    let url;
    try {
        url = new URL(text, base);
    } catch {
        throw new Error(`${text} is no address`);
    }
    if (!/^https?:$/.test(url.protocol) || url.origin !== new URL(base).origin) {
        throw new Error(`${text} is not on the server of this page`);
    }
    url.hash = '';
    return url;
}

/** The parts of an address's path as names of files. */
function names(url) {
    const all = url.pathname.split('/').map(decodeURIComponent);
    if (all.some((name) => /[/\0]/.test(name))) {
        throw new Error(`${url.pathname} has a part that is no name of a file`);
    }
    return all;
}

/** Returns the bytes of a file. No redirection is followed, which could lead to another server. */
async function read(url, account) {
    const answer = await fetch(url, { mode: 'same-origin', redirect: 'error', credentials: 'same-origin' });
    if (!answer.ok) {
        throw new Error(`the server answers ${answer.status}`);
    }
    const bytes = new Uint8Array(await answer.arrayBuffer());
    account.bytes += bytes.length;
    if (account.bytes > MOST_BYTES) {
        throw new RangeError('the files have more than 1 GB');
    }
    return bytes;
}

/** Returns the addresses of a list, a JSON file with `files`; they are relative to it. */
async function listed(url, account) {
    const content = JSON.parse(new TextDecoder().decode(await read(url, account)));
    const { files } = content ?? {};
    if (!Array.isArray(files) || files.some((file) => typeof file !== 'string') || files.length > MOST_FILES) {
        throw new Error(`${names(url).at(-1)} is no list of files`);
    }
    return files.map((file) => own(file, url));
}

/**
 * Fetches the scene that `asked` names as seen from `base`, and the files of its list. Returns the files by
 * path below the folder that all are in, the path of the scene, and lines about what is not there.
 */
export async function published({ scene, list }, base) {
    const account = { bytes: 0 };
    const first = own(scene, base);
    const others = list === undefined ? [] : await listed(own(list, base), account);
    const urls = [first, ...others.filter(({ pathname }) => pathname !== first.pathname)];
    const paths = urls.map(names);
    const folders = paths[0].slice(0, -1);
    const shared = folders.findIndex((name, i) => paths.some((path) => path.length < i + 2 || path[i] !== name));
    const depth = shared < 0 ? folders.length : shared;
    const path = (i) => paths[i].slice(depth).join('/');
    const files = new Map([[path(0), await read(first, account)]]);
    const lines = [];
    let next = 1;
    const worker = async () => {
        while (next < urls.length) {
            const i = next++;
            try {
                files.set(path(i), await read(urls[i], account));
            } catch (error) {
                if (error instanceof RangeError) {
                    throw error;
                }
                lines.push(`warning: ${path(i)} cannot be loaded: ${error.message}`);
            }
        }
    };
    await Promise.all(Array.from({ length: AT_ONCE }, worker));
    return { files, scene: path(0), lines };
}
