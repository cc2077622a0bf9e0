// Keeps the page for use without a network. The build writes the list of files and their version.

const VERSION = 'VERSION';
// The copies of the page on a server share the browser's storage: each has the cache of its address.
const CACHE = `${VERSION} ${registration.scope}`;
const FILES = ['FILES'];

addEventListener('install', (event) => {
    // The browser's own cache may still hold files of the version before.
    const fresh = FILES.map((file) => new Request(file, { cache: 'reload' }));
    const fill = async () => (await caches.open(CACHE)).addAll(fresh);
    event.waitUntil(fill().then(() => skipWaiting()));
});

addEventListener('activate', (event) => {
    const clean = async () => {
        const isOld = (name) => name.startsWith('ivcam ') && name.endsWith(` ${registration.scope}`) && name !== CACHE;
        await Promise.all((await caches.keys()).filter(isOld).map((name) => caches.delete(name)));
        await clients.claim();
    };
    event.waitUntil(clean());
});

addEventListener('fetch', (event) => {
    const kept = async () => {
        const cache = await caches.open(CACHE);
        const found = await cache.match(event.request, { ignoreSearch: true });
        return found ?? fetch(event.request);
    };
    event.respondWith(kept());
});
