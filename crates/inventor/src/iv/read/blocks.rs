//! Reads the values of a long list on the threads of rayon's current pool, a block of text each.
//!
//! A line ending ends every token but a string, comments included, so a block that ends with one
//! and contains whole values is read as it is within the whole text. If the values of a block do
//! not end with it (a value on two lines, the end of the list, a mistake), the blocks after it do
//! not count, and one thread reads on from the last whole value. The values, and the places of
//! mistakes, are the same for any number of threads.

use std::ops::RangeInclusive;

use ivcam_base::work;
use rayon::prelude::*;

use super::syntax_error::Parsed;
use super::tokens::skip;

/// The least and the most bytes of a block. The smallest takes .1 ms, so that each thread has .4 ms
/// of work in a round, which is long beside the time until it begins.
const BLOCK: RangeInclusive<usize> = 1 << 15..=1 << 19;
/// The blocks of a round for each thread, so that no thread waits long for the others.
const BLOCKS_OF_THREAD: usize = 4;
/// The length in bytes from which a list is read in the largest blocks until it ends.
const LONG: usize = 16 << 20;
/// The longest line in which a block may end, in bytes.
const LINE: usize = 4096;
/// The most threads for a list.
const MOST_THREADS: usize = 8;

/// Is called from time to time with the number of bytes that are not read yet.
pub(super) type OnProgress<'r> = &'r dyn Fn(usize);

/// A parser of one value of a list.
pub(super) trait OneValue<'a, T>:
    Fn(&'a [u8]) -> Parsed<'a, T> + Copy + Send + Sync
{
}
impl<'a, T, F: Fn(&'a [u8]) -> Parsed<'a, T> + Copy + Send + Sync> OneValue<'a, T> for F {}

/// Reads values at the start of `text` as long as whole blocks of them follow, and returns the text
/// after them. What it returns may begin with further values.
pub(super) fn read_blocks<'a, T: Send>(
    text: &'a [u8],
    left: OnProgress<'_>,
    one: impl OneValue<'a, T>,
    values: &mut Vec<T>,
) -> &'a [u8] {
    let threads = rayon::current_num_threads().min(MOST_THREADS);
    if threads < 2 {
        return text;
    }
    read_blocks_of(text, left, one, values, (threads, length(text), BLOCK))
}

/// Returns about the length of the list at the start of a text, or the largest number if it is
/// long. A list with a bracket in a string or in a comment seems shorter.
fn length(text: &[u8]) -> usize {
    let chunks = text.chunks(256).take(LONG / 256);
    let inside = chunks.take_while(|chunk| !chunk.contains(&b']'));
    match inside.map(<[u8]>::len).sum() {
        LONG => usize::MAX,
        length => length,
    }
}

/// Reads values as [`read_blocks`] does, by so many threads, from a list of about so many bytes, in
/// blocks of so many bytes.
fn read_blocks_of<'a, T: Send>(
    text: &'a [u8],
    left: OnProgress<'_>,
    one: impl OneValue<'a, T>,
    values: &mut Vec<T>,
    (threads, length, sizes): (usize, usize, RangeInclusive<usize>),
) -> &'a [u8] {
    let mut rest = text;
    let count = threads * BLOCKS_OF_THREAD;
    // The lists of a round, and of the round before, whose values are appended at the same time.
    // They are used again in each round, so that their memory is.
    let lists = || -> Vec<Vec<T>> { (0..count).map(|_| Vec::new()).collect() };
    let (mut found, mut before) = (lists(), lists());
    while !work::is_cut() {
        let share = length.saturating_sub(text.len() - rest.len()) / count;
        if share < *sizes.start() {
            break;
        }
        let Some(blocks) = split(rest, count, share.min(*sizes.end())) else {
            break;
        };
        let mut ends = vec![&rest[..0]; count];
        let reads = blocks.iter().zip(&mut found).zip(&mut ends);
        let reads = reads.map(|((block, list), end)| -> Job<'_> {
            Box::new(move || *end = read_block(block, one, list))
        });
        let append: Job<'_> = Box::new(|| before.iter_mut().for_each(|list| values.append(list)));
        run_all(std::iter::once(append).chain(reads).collect());
        let whole = ends.iter().take_while(|end| end.is_empty()).count();
        let counting = blocks.iter().zip(&ends).take(whole + 1);
        let bytes = counting.map(|(block, end)| block.len() - end.len());
        rest = &rest[bytes.sum()..];
        found.truncate(whole + 1);
        std::mem::swap(&mut found, &mut before);
        if whole < count {
            break;
        }
        left(rest.len());
    }
    before.iter_mut().for_each(|list| values.append(list));
    rest
}

type Job<'a> = Box<dyn FnOnce() + Send + 'a>;

/// Runs jobs on all threads. The jobs have one type, so that this is compiled once for all lists.
fn run_all(jobs: Vec<Job<'_>>) {
    jobs.into_par_iter().for_each(|job| job());
}

/// Returns blocks at the start of a text, or `None` if it is too short or its lines are too long.
fn split(text: &[u8], count: usize, size: usize) -> Option<Vec<&[u8]>> {
    let (mut blocks, mut rest) = (Vec::with_capacity(count), text);
    for _ in 0..count {
        let line = rest.get(size..)?.iter().take(LINE);
        let end = size + 1 + line.copied().position(|b| b == b'\n')?;
        let (block, after) = rest.split_at(end);
        blocks.push(block);
        rest = after;
    }
    Some(blocks)
}

/// Reads the values of a block, and returns the text after the last one, without the white space at
/// its end.
fn read_block<'a, T>(block: &'a [u8], one: impl OneValue<'a, T>, values: &mut Vec<T>) -> &'a [u8] {
    let mut rest = block;
    loop {
        let next = skip(rest);
        if next.is_empty() {
            return next;
        }
        match one(next) {
            Ok((after, value)) if after.len() < next.len() => {
                values.push(value);
                rest = after;
            }
            _ => return rest,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::fmt::Debug;

    use super::*;
    use crate::iv::encoding::Escapes;
    use crate::iv::read::numbers::{float, int32};
    use crate::iv::read::tokens::string;

    /// Reads a list with blocks of several sizes and without, and returns how many bytes the blocks
    /// of the least size have read.
    fn compare<T: Send + Debug + PartialEq>(
        text: &str,
        one: impl for<'a> Fn(&'a [u8]) -> Parsed<'a, T> + Copy + Send + Sync,
    ) -> usize {
        let text = text.as_bytes();
        let (mut expected, mut by_blocks) = (Vec::new(), 0);
        let end = skip(read_block(text, one, &mut expected)).len();
        for (threads, size) in [(3, 97), (2, 1000), (5, 4000)] {
            let (mut values, left) = (Vec::new(), Cell::new(text.len()));
            let told = |bytes: usize| assert!(left.replace(bytes) > bytes);
            let blocks = (threads, text.len(), size / 2..=size);
            let rest = read_blocks_of(text, &told, one, &mut values, blocks);
            by_blocks = by_blocks.max(text.len() - rest.len());
            let last = skip(read_block(rest, one, &mut values)).len();
            assert_eq!(values, expected, "{threads} {size}");
            assert_eq!(last, end, "{threads} {size}");
        }
        by_blocks
    }

    fn pair(input: &[u8]) -> Parsed<'_, (f32, f32)> {
        let (rest, x) = float(input)?;
        let (rest, y) = float(skip(rest))?;
        Ok((rest, (x, y)))
    }

    #[test]
    fn a_list_is_read_in_blocks_as_in_one_piece() {
        let lines = |line: &str| line.repeat(30_000 / line.len());
        let most = |read: usize| assert!(read > 25_000 - 4096, "{read}");
        let little = |read: usize| assert!(read < 5000, "{read}");
        most(compare(&lines("1 2.5, -3e2 4,\n"), pair));
        most(compare(&lines("12, 7, -1,\r\n"), int32));
        most(compare(&lines("1 2 # 3 ] { \" 4\n"), pair));
        fn quoted(text: &[u8]) -> Parsed<'_, String> {
            string(text, Escapes::Quote)
        }
        most(compare(&lines("\"a ] 1\\\" \" b,\n"), quoted));
        compare(&lines("\"a\nb\"\n"), quoted);
        // Pairs that lie on two lines, and no line endings at all.
        little(compare(&lines("1 2 3\n"), pair));
        little(compare(&lines("1 2 3 4 "), int32));
        little(compare(&lines("1 2\r"), int32));
        // The list ends, or has a mistake, within a block; what follows looks like more of it.
        for stop in ["] }", "oops", "1.5.", "\"", "-", "1 # 2"] {
            let text = lines("1 2\n") + stop + "\n" + &lines("3 4\n");
            assert!(compare(&text, pair) > 20_000);
            compare(&text, int32);
        }
        compare("", int32);
        compare("1", int32);
    }
}
