//! Damages inputs in a way that is the same in every run.

use ivcam_optics::sampling::mix;

/// A random number generator with a seed.
pub(super) struct Dice(pub(super) u64);

impl Dice {
    /// Returns a number below `n`, which must not be 0.
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0 = mix(self.0);
        (self.0 >> 11) as usize % n
    }
}

/// Damages an input in one to four places: inverts a bit, replaces a byte, cuts, removes or repeats
/// a piece, inserts a word of the dictionary, or replaces a number.
pub(super) fn mutated(input: &[u8], words: &[String], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = input.to_vec();
    for _ in 0..1 + dice.below(4) {
        if bytes.is_empty() {
            break;
        }
        let at = dice.below(bytes.len());
        let piece = at..(at + 1 + dice.below(40)).min(bytes.len());
        match dice.below(7) {
            0 => bytes[at] ^= 1 << dice.below(8),
            1 => bytes[at] = dice.below(256) as u8,
            2 if dice.below(8) == 0 => bytes.truncate(at),
            2 | 3 => drop(bytes.drain(piece)),
            4 => {
                let copy = bytes[piece].to_vec();
                let to = dice.below(bytes.len());
                drop(bytes.splice(to..to, copy));
            }
            5 if !words.is_empty() => {
                let word = words[dice.below(words.len())].bytes();
                drop(bytes.splice(at..at, word));
            }
            _ => replace_number(&mut bytes, at, dice),
        }
    }
    bytes
}

/// Replaces the next number by one at a limit.
fn replace_number(bytes: &mut Vec<u8>, at: usize, dice: &mut Dice) {
    const NUMBERS: [&str; 8] = [
        "-1",
        "0",
        "nan",
        "1e38",
        "1e-45",
        "-1e300",
        "4294967295",
        "65536",
    ];
    let is_part = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
    let Some(start) = bytes[at..].iter().position(u8::is_ascii_digit) else {
        return;
    };
    let start = at + start;
    let length = bytes[start..].iter().position(|b| !is_part(b));
    let end = length.map_or(bytes.len(), |length| start + length);
    let number = NUMBERS[dice.below(NUMBERS.len())].bytes();
    drop(bytes.splice(start..end, number));
}
