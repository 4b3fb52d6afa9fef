//! What becomes of a file: some mutations of it, drawn by a seed.

use geometry::SplitMix64;

/// What a file is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Any bytes.
    Bytes,
    /// Text with numbers, keys and lists.
    Text,
}

/// Mutations of one input at most.
const MOST: usize = 4;
/// Levels of lists in lists: more than a stack bears, if one is taken for each.
const DEPTH: usize = 100_000;
/// Bytes that lengths and signs are made of.
const BYTES: [u8; 6] = [0, 1, 0x7f, 0x80, 0xfe, 0xff];
/// What may stand where a value does.
const VALUES: [&str; 30] = [
    "0",
    "-0.0",
    "-1",
    "1",
    "2",
    "3",
    "0.5",
    "1e308",
    "-1e308",
    "1e999",
    "1e-320",
    "4294967295",
    "4294967296",
    "2147483648",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "-9223372036854775809",
    "65535",
    "1000000000",
    "NaN",
    "Infinity",
    "null",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"\\u0000é\"",
    "[[[[]]]]",
    "[1,2,3,4,5,6,7]",
];

/// An input of its own for each seed.
pub fn mutated(seeds: &[Vec<u8>], kind: Kind, seed: u64) -> Vec<u8> {
    let mut random = SplitMix64::new(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
    let mut input = seeds[below(&mut random, seeds.len())].clone();
    for _ in 0..=below(&mut random, MOST) {
        let other = &seeds[below(&mut random, seeds.len())];
        if kind == Kind::Text && below(&mut random, 4) > 0 {
            change_text(&mut input, other, &mut random);
        } else {
            change_bytes(&mut input, other, &mut random);
        }
    }
    input
}

/// A number from 0 to below `count`; 0 where there is none.
fn below(random: &mut SplitMix64, count: usize) -> usize {
    (random.bits() % count.max(1) as u64) as usize
}

/// A part of so many bytes.
fn part(random: &mut SplitMix64, length: usize) -> std::ops::Range<usize> {
    let first = below(random, length);
    // Short ones are commoner.
    let longest = (length - first) >> below(random, 12);
    first..first + below(random, longest + 1)
}

fn change_bytes(input: &mut Vec<u8>, other: &[u8], random: &mut SplitMix64) {
    let at = below(random, input.len());
    match below(random, 7) {
        0 if !input.is_empty() => input[at] ^= 1 << below(random, 8),
        1 if !input.is_empty() => input[at] = BYTES[below(random, BYTES.len())],
        2 if !input.is_empty() => input[at] = random.bits() as u8,
        3 => input.truncate(at),
        4 => drop(input.drain(part(random, input.len()))),
        5 => {
            let again = input[part(random, input.len())].to_vec();
            input.splice(at..at, again);
        }
        _ => {
            let foreign = other[part(random, other.len())].to_vec();
            let replaced = at..(at + below(random, foreign.len() + 1)).min(input.len());
            input.splice(replaced, foreign);
        }
    }
}

fn change_text(input: &mut Vec<u8>, other: &[u8], random: &mut SplitMix64) {
    let values = values(input);
    let Some(value) = values.get(below(random, values.len())).cloned() else { return };
    match below(random, 10) {
        0 => {
            let foreign = self::values(other);
            let foreign = foreign.get(below(random, foreign.len())).cloned().unwrap_or(0..0);
            input.splice(value, other[foreign].to_vec());
        }
        1 => {
            // A value twice in a list.
            let again = [b",", &input[value.clone()]].concat();
            input.splice(value.end..value.end, again);
        }
        2 if below(random, 20) == 0 => drop(input.splice(value, "[".repeat(DEPTH).into_bytes())),
        _ => drop(input.splice(value, VALUES[below(random, VALUES.len())].bytes())),
    }
}

/// Where numbers, words, strings, lists and objects are.
fn values(text: &[u8]) -> Vec<std::ops::Range<usize>> {
    let (mut found, mut open, mut at) = (Vec::new(), Vec::new(), 0);
    let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
    while at < text.len() {
        let length = match text[at] {
            b'"' => 2 + text[at + 1..].iter().take_while(|byte| **byte != b'"').count(),
            byte if is_word(&byte) => text[at..].iter().take_while(|byte| is_word(byte)).count(),
            _ => 1,
        };
        let end = (at + length).min(text.len());
        match text[at] {
            b'[' | b'{' => open.push(at),
            b']' | b'}' => found.extend(open.pop().map(|first| first..end)),
            byte if byte == b'"' || is_word(&byte) => found.push(at..end),
            _ => {}
        }
        at = end;
    }
    found
}
