// The workers, and the passes in which they expose a picture.
//
// The picture is divided into bands of rows. A task adds samples to one band; its sums come back as
// bytes and go to whichever worker adds the next samples. The sums of all bands are joined by the
// program itself, so the picture has the bits of the command line.

/** How long a job of a picture that nobody wants any more may still run, in milliseconds. */
const PATIENCE = 1500;
/** How long one job may take, in milliseconds, before the page gives up. */
export const LIMIT = 120_000;

/** One worker, which is replaced when it breaks or has to be stopped. */
class Hand {
    constructor(crew) {
        this.crew = crew;
        this.begin();
    }

    begin() {
        this.worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
        this.waiting = new Map();
        this.run = undefined;
        this.stale = true;
        this.worker.onmessage = ({ data }) => {
            const { resolve, timer } = this.waiting.get(data.id) ?? {};
            clearTimeout(timer);
            this.waiting.delete(data.id);
            if (data.broken) {
                this.fail(data.broken);
            }
            resolve?.(data);
        };
        this.worker.onerror = (event) => {
            event.preventDefault();
            this.fail(event.message || 'the worker ended');
        };
        this.post({ job: 'start', module: this.crew.module });
    }

    /** Ends the worker, and lets its jobs fail. A new one takes its place. */
    fail(why) {
        this.worker.terminate();
        const lost = this.waiting.values();
        this.begin();
        for (const { resolve, timer } of lost) {
            clearTimeout(timer);
            resolve({ code: 2, broken: why, messages: '', out: '' });
        }
    }

    get isBusy() {
        return this.waiting.size > 0;
    }

    /** Whether it does a command that a person waits for. */
    get isNeeded() {
        return [...this.waiting.values()].some(({ job }) => job === 'run' || job === 'save');
    }

    post(message, transfer = []) {
        const id = ++this.crew.last;
        return new Promise((resolve) => {
            const late = () => this.fail(`it took more than ${LIMIT / 1000} seconds`);
            this.waiting.set(id, { resolve, job: message.job, timer: setTimeout(late, LIMIT) });
            this.worker.postMessage({ ...message, id }, transfer);
        });
    }

    /** Does a job with the files of the page. */
    async does(message, transfer) {
        if (this.stale) {
            this.stale = false;
            await this.post({ job: 'files', files: this.crew.files });
        }
        return this.post(message, transfer);
    }
}

/** The bands of a picture, and what is known of each. */
export class Exposure {
    constructor(words, camera, answer) {
        const { size: [width, height], corner: [left, top], samples, period } = answer;
        Object.assign(this, { words, camera, answer, width, height, left, top, samples });
        const whole = answer['in one part'];
        // A task of 64 samples per pixel should take seconds at most, also with light paths.
        const step = whole ? height : width > 500 ? 8 : 16;
        this.bands = [];
        for (let y = 0; y < height; y += step) {
            const rows = Math.min(step, height - y);
            this.bands.push({ region: [left, top + y, width, rows], y, done: 0, isTaken: false });
        }
        const period0 = Math.min(Math.max(period, 1), samples);
        const ends = [1, 4, 16, 64].filter((n) => n < samples && n % period0 === 0 && !whole);
        for (let n = 128; n < samples && !whole; n += n < 1024 ? 64 : n >> 3) {
            if (n % period0 === 0) {
                ends.push(n);
            }
        }
        this.ends = [...ends, samples];
        this.joined = 0;
        this.isJoining = false;
        this.isCanceled = false;
        this.waiters = [];
    }

    /** The number of samples that all bands have. */
    get done() {
        return Math.min(...this.bands.map((band) => band.done));
    }

    get isFinished() {
        return this.joined >= this.samples;
    }

    /** The next task: to join what is there, or the band with the fewest samples. */
    next() {
        const { done } = this;
        const isPass = this.ends.includes(done);
        if (!this.isJoining && done > this.joined && isPass && (done >= 4 || done === this.samples)) {
            return { join: done, parts: this.bands.map((band) => band.sums) };
        }
        const free = this.bands.filter((band) => !band.isTaken && band.done < this.samples);
        // No band is ahead by more than a pass, so that the sums of one pass can be joined.
        const ahead = this.ends.find((n) => n > done);
        const least = free.filter((band) => band.done < ahead);
        return least[0] && { band: least[0], samples: ahead };
    }

    /** Waits until something has changed. */
    changed() {
        return new Promise((go) => this.waiters.push(go));
    }

    change() {
        this.waiters.splice(0).forEach((go) => go());
    }

    cancel() {
        this.isCanceled = true;
        this.change();
    }
}

export class Crew {
    constructor(module, count) {
        this.module = module;
        this.last = 0;
        this.files = [];
        this.hands = Array.from({ length: count }, () => new Hand(this));
        this.photograph = undefined;
        this.order = 0;
    }

    /** Replaces the files that the workers see. */
    setFiles(files) {
        this.stop();
        this.files = files;
        this.hands.forEach((hand) => {
            hand.stale = true;
        });
    }

    /** Drops the picture in work. */
    stop() {
        this.order++;
        this.photograph?.cancel();
    }

    /** A worker for a command. */
    get idle() {
        return this.hands.find((hand) => !hand.isBusy) ?? this.hands.at(-1);
    }

    command(words, outputs) {
        return this.idle.does({ job: 'run', words, outputs });
    }

    /** Frees a worker from a job that nobody wants any more. */
    async free(hand) {
        const end = performance.now() + PATIENCE;
        while (hand.isBusy && (hand.isNeeded || performance.now() < end)) {
            await new Promise((go) => setTimeout(go, 5));
        }
        if (hand.isBusy) {
            hand.fail('stopped');
        }
    }

    /**
     * Shows the open scene at once with the lens and the camera of a command line, in a small picture.
     * Of several that are asked for meanwhile, the last is shown. Drops the picture in work.
     */
    async glances(words, camera, divisor, show) {
        this.stop();
        const isShowing = this.glance !== undefined || this.isGlancing;
        this.glance = { job: 'preview', words, camera, divisor };
        if (isShowing) {
            return;
        }
        this.isGlancing = true;
        const [hand] = this.hands;
        while (this.glance) {
            const { glance } = this;
            this.glance = undefined;
            const quick = hand.run !== undefined && !hand.stale ? await hand.does(glance) : {};
            if (quick.code === 0) {
                show(quick);
            }
        }
        this.isGlancing = false;
    }

    /**
     * Makes the picture of a command line. `on` has the functions `opened`, `pixels`, `joined`, `failed`
     * and `finished`. Returns when the picture is finished or dropped.
     */
    async photographs(words, camera, on) {
        this.stop();
        const order = this.order;
        const isOld = () => order !== this.order;
        let exposure;
        const opened = async (hand) => {
            await this.free(hand);
            if (isOld()) {
                return undefined;
            }
            hand.run = undefined;
            const result = await hand.does({ job: 'open', words, camera });
            hand.run = result.code === 0 ? order : undefined;
            return isOld() ? undefined : result;
        };
        let isAnswered = false;
        const work = async (hand) => {
            const result = await opened(hand);
            if (!result) {
                return;
            }
            if (!isAnswered) {
                isAnswered = true;
                if (result.code !== 0) {
                    this.order++;
                    on.failed(result);
                    return;
                }
                exposure = new Exposure(words, camera, result.answer);
                this.photograph = exposure;
                on.opened(result, exposure);
            }
            if (result.code === 0) {
                await this.#exposes(hand, exposure, on, isOld);
            }
        };
        await Promise.all(this.hands.map(work));
        if (!isOld() && exposure?.isFinished) {
            on.finished(exposure);
        }
    }

    async #exposes(hand, exposure, on, isOld) {
        while (!isOld() && !exposure.isFinished) {
            const task = exposure.next();
            if (!task) {
                await exposure.changed();
                continue;
            }
            const done = task.band
                ? await this.#exposesBand(hand, exposure, task, on, isOld)
                : await this.#joins(hand, exposure, task, on, isOld);
            exposure.change();
            if (!done) {
                return;
            }
        }
    }

    async #exposesBand(hand, exposure, { band, samples }, on, isOld) {
        band.isTaken = true;
        const job = { job: 'expose', region: band.region, samples, sums: band.sums };
        const result = await hand.does(job);
        band.isTaken = false;
        if (isOld()) {
            return false;
        }
        if (result.code !== 0) {
            this.#broke(exposure, result, on);
            return false;
        }
        band.sums = result.sums;
        band.done = samples;
        on.pixels(band, result.pixels, exposure);
        return true;
    }

    async #joins(hand, exposure, { join, parts }, on, isOld) {
        exposure.isJoining = true;
        const result = await hand.does({ job: 'join', parts });
        exposure.isJoining = false;
        // The worker has the joined picture now, also when the picture was dropped meanwhile.
        if (result.code === 0) {
            const { answer: report, pixels } = result;
            Object.assign(exposure, { joined: join, joinedAt: performance.now(), holder: hand, report, pixels });
        }
        if (isOld()) {
            return false;
        }
        if (result.code !== 0) {
            this.#broke(exposure, result, on);
            return false;
        }
        on.joined(result, exposure);
        return true;
    }

    #broke(exposure, result, on) {
        this.order++;
        exposure.cancel();
        on.failed(result);
    }
}
