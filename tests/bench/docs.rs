//! Sections of a document that a benchmark writes, one for each machine, so that no figure is written by hand.
#![allow(dead_code)] // each benchmark uses its own part

use pulp::Arch;

/// The processor as the system names it, its cores, and the registers that kernels use on it.
pub fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")).and_then(|line| line.split_once(": "));
    let name = name.map_or(std::env::consts::ARCH, |name| name.1).replace("(R)", "").replace("(TM)", "");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores, {}", registers())
}

/// The widest registers here.
pub fn registers() -> &'static str {
    match Arch::new() {
        Arch::Scalar => "plain arithmetic",
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "AVX2",
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "AVX-512",
        _ => "vectors",
    }
}

/// Processes that ran or waited, on average over a minute; the cores of a quiet machine run less than one.
pub fn load() -> String {
    let text = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    text.split_whitespace().next().unwrap_or("unknown").to_owned()
}

/// Puts `text` between the marks of the section `name` in the file at `path`, or, where there are none, before the line
/// `<!-- end of WHAT -->`, `what` being the first word of the name.
pub fn put_section(path: &str, name: &str, text: &str) -> std::io::Result<()> {
    let document = std::fs::read_to_string(path)?;
    let (begin, end) = (format!("<!-- begin {name} -->\n"), format!("<!-- end {name} -->\n"));
    let section = format!("{begin}\n{}\n\n{end}", text.trim());
    let what = name.split(' ').next().unwrap_or_default();
    let last = format!("<!-- end of {what} -->\n");
    let place = |mark: &str| document.find(mark);
    let document = match (place(&begin), place(&end), place(&last)) {
        (Some(from), Some(to), _) => format!("{}{section}{}", &document[..from], &document[to + end.len()..]),
        (_, _, Some(at)) => format!("{}{section}\n{}", &document[..at], &document[at..]),
        _ => return Err(std::io::Error::other(format!("{path} has no line {}", last.trim()))),
    };
    std::fs::write(path, document)
}
