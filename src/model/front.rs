//! What a choice of a method went by: the candidates, and its saved form, the section "AUTO" of a model with c candidates.
//!
//! | what | type |
//! |---|---|
//! | c, the number of the choice | 2 × u32 |
//! | of each: method, 1 on a sagged shape else 0, fields, elements | 4c × u32 |
//! | of each: operations, error | 2c × f64 |

use crate::Result;
use crate::error::invalid;
use crate::method::Method;
use crate::real::Real;

/// A method on a model of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// How it moves.
    pub method: Method,
    /// On modes of the shape that hangs under the demand's gravity.
    pub sagged: bool,
    /// Fields beyond the modes, and elements that stand for all, of a reduced shell.
    pub fields: usize,
    /// See there.
    pub elements: usize,
    /// Of a step.
    pub operations: f64,
    /// The furthest that a vertex is off, length; infinite where it finds no equilibrium.
    pub error: f64,
}

/// The candidates and which of them was taken.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    /// In the order in which they were tried.
    pub candidates: Vec<Candidate>,
    /// Its number.
    pub chosen: usize,
}

impl Front {
    /// The one that was taken.
    pub fn choice(&self) -> &Candidate {
        &self.candidates[self.chosen]
    }
}

const COUNTS: usize = 8;
const WORDS: usize = 16;
const NUMBERS: usize = 16;

impl Front {
    /// Size of [`Front::save`].
    pub fn saved_size(&self) -> usize {
        COUNTS + (WORDS + NUMBERS) * self.candidates.len()
    }

    /// Appends the content of the section.
    pub fn save(&self, out: &mut Vec<u8>) {
        let mut put = |word: usize| out.extend((word as u32).to_le_bytes());
        put(self.candidates.len());
        put(self.chosen);
        for c in &self.candidates {
            [c.method.number() as usize, usize::from(c.sagged), c.fields, c.elements].into_iter().for_each(&mut put);
        }
        self.candidates.iter().for_each(|c| [c.operations, c.error].iter().for_each(|x| x.put(out)));
    }

    /// What [`Front::save`] wrote.
    pub fn load(content: &[u8]) -> Result<Self> {
        let Some((counts, rest)) = content.split_at_checked(COUNTS) else {
            return invalid(format!("{} bytes are no choice of a method", content.len()));
        };
        let word = |row: &[u8]| u32::from_le_bytes(row.try_into().expect("four bytes")) as usize;
        let (count, chosen) = (word(&counts[..4]), word(&counts[4..]));
        if chosen >= count || rest.len() as u128 != (WORDS + NUMBERS) as u128 * count as u128 {
            return invalid(format!("{} bytes are not {count} methods, number {chosen} of them chosen", content.len()));
        }
        let (words, numbers) = rest.split_at(WORDS * count);
        let candidate = |(words, numbers): (&[u8], &[u8])| {
            let [method, sagged, fields, elements] = std::array::from_fn(|i| word(&words[4 * i..4 * i + 4]));
            let (operations, error) = (f64::get(&numbers[..8]), f64::get(&numbers[8..]));
            match Method::of_number(method as u32) {
                Some(method) if sagged <= 1 && operations >= 0.0 && operations.is_finite() && error >= 0.0 => {
                    Ok(Candidate { method, sagged: sagged == 1, fields, elements, operations, error })
                }
                _ => invalid(format!("method {method} of its choice is out of range")),
            }
        };
        let candidates = words.chunks_exact(WORDS).zip(numbers.chunks_exact(NUMBERS)).map(candidate);
        Ok(Self { candidates: candidates.collect::<Result<_>>()?, chosen })
    }
}
