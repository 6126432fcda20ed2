//! The rooms of `src` form a ladder: a room uses only those below it, so that no two depend on each other.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The rooms from the ground up. ARCHITECTURE.md says what each is for.
const LADDER: [&str; 36] = [
    "error",
    "real",
    "clock",
    "features",
    "arithmetic",
    "rotation",
    "limits",
    "method", // vocabulary
    "threads",
    "mesh",
    "material",
    "energy",
    "support",
    "sparse",
    "shell",
    "load",
    "constraint",
    "point_energy", // the physical problem, and what holds it
    "collider",     // solids that shells touch
    "contact",
    "binding", // points that follow a shell
    "proxy",   // a mesh to simulate in another's place
    "warp",
    "precision",
    "modes",
    "reference",
    "step", // kernels
    "modal",
    "strain",
    "reduced", // what methods are made of
    "model",
    "methods",
    "state",
    "auto",
    "ffi",
    "lib",
];

/// The room of each name that `lib.rs` exports beside the rooms themselves.
const EXPORTED: [(&str, &str); 10] = [
    ("Error", "error"),
    ("ErrorKind", "error"),
    ("Result", "error"),
    ("Material", "material"),
    ("Mesh", "mesh"),
    ("Model", "model"),
    ("Shell", "shell"),
    ("State", "state"),
    ("Supports", "support"),
    ("Vec3", "error"), // of no room: on the ground
];

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("src is there") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The first part of the path below `src`, without `.rs`.
fn room_of(path: &Path, src: &Path) -> String {
    let below = path.strip_prefix(src).expect("below src");
    let first = below.components().next().expect("a name").as_os_str().to_string_lossy().into_owned();
    first.trim_end_matches(".rs").to_string()
}

/// The first names of all paths that begin with `crate::` in a file's code, those in braces one by one.
fn first_names(code: &str) -> Vec<String> {
    let name = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut names = vec![];
    for (at, _) in code.match_indices("crate::") {
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            None => names.push(name(rest)),
            Some(list) => {
                let mut depth = 1;
                let mut item = String::new();
                for c in list.chars() {
                    depth += i32::from(c == '{') - i32::from(c == '}');
                    if depth == 0 || (depth == 1 && c == ',') {
                        names.push(name(item.trim_start()));
                        item.clear();
                        if depth == 0 {
                            break;
                        }
                    } else {
                        item.push(c);
                    }
                }
            }
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

/// Without comments, and without the tests at the end of a file.
fn code_of(text: &str) -> String {
    let body = text.split("#[cfg(test)]").next().unwrap_or(text);
    body.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n")
}

#[test]
fn every_room_uses_only_rooms_below_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let level: BTreeMap<&str, usize> = LADDER.iter().enumerate().map(|(i, room)| (*room, i)).collect();
    let exported: BTreeMap<&str, &str> = EXPORTED.into_iter().collect();
    let mut files = vec![];
    rust_files(&src, &mut files);
    assert!(files.len() > 50, "only {} files were found", files.len());
    let (mut wrong, mut arrows) = (vec![], 0);
    for path in &files {
        let room = room_of(path, &src);
        if room == "lib" {
            continue;
        }
        let own = *level.get(room.as_str()).unwrap_or_else(|| panic!("the room {room} is not on the ladder"));
        for name in first_names(&code_of(&fs::read_to_string(path).expect("readable"))) {
            let used = exported.get(name.as_str()).copied().unwrap_or(&name);
            let Some(other) = level.get(used) else { continue }; // a function or macro of lib.rs
            arrows += 1;
            if *other > own {
                wrong.push(format!("{} uses {used}, which is above {room}", path.display()));
            }
        }
    }
    assert!(arrows > 200, "only {arrows} uses were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn names_are_read_out_of_paths_lists_and_nested_lists() {
    let code = "use crate::a::B;\nuse crate::{Error, c::{d, E}, self as _};\ncrate::f::g()";
    assert_eq!(first_names(code), ["a", "Error", "c", "self", "f"]);
    assert_eq!(code_of("use x; // crate::y\n#[cfg(test)]\nmod t;"), "use x; ");
}
