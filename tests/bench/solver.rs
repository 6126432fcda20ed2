//! What searches on the full shell take, by the energy alone and with the stress as an unknown: factorizations and seconds.
//!
//! | argument | searches |
//! |---|---|
//! | rest | equilibria from rest under the forces of `front/scenes.rs`, up to large ones |
//! | loads | equilibria under all loads of docs/evidence/front.md, as they grow there |
//! | paper | equilibria of the paper's scenes |
//! | led | equilibria of the judging list's shells, led and turned by a handle |
//! | steps | steps of 1/30 s of shells that swing, and of a character's garments that dance |
//! | limp | the same of cotton that hangs limp and is blown on |
//! | threads | the same on several numbers of threads, with the bits of where they end compared |
//!
//! usage: solver [--docs FILE] [rest | loads | paper | led | steps | limp | threads [COUNT ...]] [SHELL ...]; without one, the first five
#![allow(missing_docs)]

#[path = "solver/by_threads.rs"]
mod by_threads;
#[path = "front/cases.rs"]
#[allow(dead_code)] // the front's own
mod cases;
#[path = "solver/character.rs"]
mod character;
#[path = "../common/mod.rs"]
mod common;
mod docs;
#[path = "solver/from_rest.rs"]
mod from_rest;
#[path = "front/judging.rs"]
mod judging;
#[path = "solver/led.rs"]
mod led;
#[path = "solver/limp.rs"]
mod limp;
#[path = "solver/loads.rs"]
mod loads;
#[path = "solver/pair.rs"]
mod pair;
#[path = "solver/paper.rs"]
mod paper;
#[path = "front/scenes.rs"]
#[allow(dead_code)] // the front's own
mod scenes;
#[path = "solver/steps.rs"]
mod steps;

/// Whether a shell is asked for; all are where none is named.
fn wanted(only: &[String], name: &str) -> bool {
    only.is_empty() || only.iter().any(|o| o == name)
}

fn main() {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let docs = arguments.iter().position(|a| a == "--docs").map(|i| arguments.drain(i..i + 2).nth(1).expect("a file"));
    let modes = ["rest", "loads", "paper", "led", "steps", "limp", "threads"];
    let asked: Vec<String> = match arguments.first() {
        Some(mode) if modes.contains(&mode.as_str()) => vec![arguments.remove(0)],
        _ => modes[..5].iter().map(|mode| (*mode).to_owned()).collect(),
    };
    let put = |name: &str, table: &str| docs.iter().for_each(|file| docs::put_section(file, name, table).unwrap());
    for mode in asked {
        match mode.as_str() {
            "rest" => put("solver", &from_rest::table(&arguments)),
            "loads" => {
                let [table, ends] = loads::tables(&arguments);
                put("loads", &table);
                put("elsewhere", &ends);
            }
            "paper" => put("paper", &paper::table(&arguments)),
            "led" => put("led", &led::table(&arguments)),
            "steps" => put("steps", &steps::table(&arguments)),
            "limp" => limp::table(&arguments),
            _ => {
                let (counts, only): (Vec<_>, Vec<_>) =
                    std::mem::take(&mut arguments).into_iter().partition(|a| a.parse::<usize>().is_ok());
                let counts: Vec<usize> = counts.iter().map(|count| count.parse().unwrap()).collect();
                put("threads", &by_threads::table(if counts.is_empty() { &[1, 2] } else { &counts }, &only));
            }
        }
    }
}
