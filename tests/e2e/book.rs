//! The book: every command of its pages, as a reader types them, and its table of contents.
//!
//! Each page is done in a folder of its own, which has the repository's `config` and `experiments`. What follows the language of a fenced
//! block says what is done with it:
//!
//! | block | is |
//! |---|---|
//! | `sh` | run to its end, which must be exit code 0; `exit=3` expects another code |
//! | `sh beside=TEXT` | started, and left running to the page's end as soon as it has printed TEXT: another terminal |
//! | `sh not-run=REASON` | not run |
//! | `sh by=fleet` | run by `just fleet`, which builds that program |
//! | `python file=NAME`, `toml file=NAME` | written into the folder |
//! | `toml in=NAME` | put into a file of the folder, in place of the keys that it has |
//! | `text` | what the block before it prints; `...` stands for anything |
//!
//! Programs are those of this build. A service of a page listens on a port of its own, and its clients find it.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that cannot go on fails")]

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::{env, thread};

use tactus_e2e::{DEADLINE, binary, free_endpoint, repository, tactus};
use tempfile::TempDir;
use toml::Table;

/// A test for each page with commands.
macro_rules! pages {
    ($($name:ident: $path:literal,)*) => {
        const PAGES: &[&str] = &[$($path),*];
        $(
            #[test]
            #[ignore = "`just book` runs the pages, some two minutes"]
            fn $name() {
                Page::read($path).done();
            }
        )*
    };
}

pages! {
    readme: "README.md",
    tutorial: "docs/book/tutorial.md",
    service: "docs/book/how-to/service.md",
    dashboard: "docs/book/how-to/dashboard.md",
    hardware: "docs/book/how-to/hardware.md",
    sensor: "docs/book/how-to/sensor.md",
    stage: "docs/book/how-to/stage.md",
    experiment: "docs/book/how-to/experiment.md",
    effect: "docs/book/how-to/effect.md",
    recordings: "docs/book/how-to/recordings.md",
    hosts: "docs/book/how-to/hosts.md",
    calibrate: "docs/book/how-to/calibrate.md",
    discover: "docs/book/how-to/discover.md",
    simulate: "docs/book/how-to/simulate.md",
    safety: "docs/book/explanation/safety.md",
}

/// Blocks that no test runs, on all pages. Each needs what a test does not have.
const NOT_RUN_MAX: usize = 16;

#[test]
fn every_page_with_commands_has_its_test() {
    let with_commands: BTreeSet<String> =
        book().into_iter().filter(|path| Page::read(path).blocks.iter().any(Block::is_run)).collect();
    let tested: BTreeSet<String> =
        PAGES.iter().filter(|path| **path != "README.md").map(ToString::to_string).collect();
    assert_eq!(with_commands, tested);
}

#[test]
fn few_blocks_are_not_run_and_each_says_why() {
    let pages = book().into_iter().chain(["README.md".to_owned()]);
    let reasons: Vec<String> = pages
        .flat_map(|path| Page::read(&path).blocks)
        .filter(Block::is_shell)
        .filter_map(|block| block.word("not-run").map(str::to_owned))
        .collect();
    assert!(reasons.len() <= NOT_RUN_MAX && reasons.iter().all(|reason| !reason.is_empty()), "{reasons:?}");
}

#[test]
fn commands_stand_in_fenced_blocks_only() {
    for path in book() {
        for line in fs::read_to_string(repository(&path)).unwrap().lines() {
            assert!(!line.starts_with("    tactus"), "{path}: {line}");
        }
    }
}

#[test]
fn the_table_of_contents_names_each_page_once() {
    let summary = fs::read_to_string(repository("docs/SUMMARY.md")).unwrap();
    let mut listed: Vec<String> = links(&summary).map(|link| format!("docs/{link}")).collect();
    listed.sort();
    assert!(listed.windows(2).all(|two| two[0] != two[1]), "a page is listed twice");
    let mut there: Vec<String> = pages_below("docs")
        .into_iter()
        .filter(|path| path != "docs/SUMMARY.md" && path != "docs/README.md")
        .collect();
    there.sort();
    assert_eq!(listed, there);
}

/// A page is read in a browser, too, which has only the pages.
#[test]
fn pages_of_the_book_link_to_pages_and_pictures_only() {
    for path in book() {
        let text = fs::read_to_string(repository(&path)).unwrap();
        let folder = repository(&path).parent().unwrap().to_owned();
        for link in links(&text).filter(|link| !link.starts_with("http") && !link.starts_with('#')) {
            let file = link.split('#').next().unwrap();
            let target =
                folder.join(file).canonicalize().unwrap_or_else(|error| panic!("{path}: {link}: {error}"));
            let is_in_book = target.starts_with(repository("docs").canonicalize().unwrap());
            assert!(is_in_book, "{path}: {link} is outside of docs: name the file in backquotes instead");
        }
    }
}

/// The pages of `docs/book`, relative to the repository.
fn book() -> Vec<String> {
    pages_below("docs/book")
}

fn pages_below(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(repository(folder)).unwrap() {
        let entry = entry.unwrap();
        let path = format!("{folder}/{}", entry.file_name().to_str().unwrap());
        if entry.file_type().unwrap().is_dir() {
            found.extend(pages_below(&path));
        } else if Path::new(&path).extension().is_some_and(|kind| kind == "md") {
            found.push(path);
        }
    }
    found
}

/// Targets of links.
fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| Some(rest.split_once(')')?.0))
}

/// A fenced block.
#[derive(Debug)]
struct Block {
    /// Of its first line.
    line: usize,
    /// Language and what follows it.
    info: String,
    text: String,
}

impl Block {
    fn language(&self) -> &str {
        self.info.split(' ').next().unwrap_or("")
    }

    fn is_shell(&self) -> bool {
        self.language() == "sh"
    }

    fn is_run(&self) -> bool {
        self.is_shell() && self.word("not-run").is_none() && self.word("by").is_none()
    }

    /// The value of `name=value` in the block's first line.
    fn word(&self, name: &str) -> Option<&str> {
        self.info.split(' ').find_map(|word| word.strip_prefix(name)?.strip_prefix('='))
    }
}

/// A page and its blocks.
struct Page {
    path: String,
    blocks: Vec<Block>,
}

impl Page {
    fn read(path: &str) -> Self {
        let text = fs::read_to_string(repository(path)).unwrap();
        let mut blocks: Vec<Block> = Vec::new();
        let mut open = false;
        for (index, line) in text.lines().enumerate() {
            if let Some(info) = line.strip_prefix("```") {
                if !open {
                    blocks.push(Block { line: index + 1, info: info.to_owned(), text: String::new() });
                }
                open = !open;
            } else if open {
                let block = blocks.last_mut().unwrap();
                block.text.push_str(line);
                block.text.push('\n');
            }
        }
        assert!(!open, "{path}: a block is not closed");
        Self { path: path.to_owned(), blocks }
    }

    /// Does everything that the page says.
    fn done(&self) {
        let mut reader = Reader::new();
        let mut printed = String::new();
        for block in &self.blocks {
            let place = format!("{}:{}", self.path, block.line);
            match block.language() {
                "sh" if !block.is_run() => {}
                "sh" => match block.word("beside") {
                    Some(text) => reader.start(&block.text, text, &place),
                    None => printed = reader.run(block, &place),
                },
                "text" => check_printed(&block.text, &printed, &place),
                "toml" if block.word("in").is_some() => reader.put(block, &place),
                _ => {
                    if let Some(name) = block.word("file") {
                        fs::write(reader.folder.path().join(name), &block.text).unwrap();
                    }
                }
            }
        }
    }
}

/// Who does what a page says, in a folder of their own.
struct Reader {
    folder: TempDir,
    /// Where the page's service listens.
    endpoint: String,
    /// True from when the page starts something that serves or simulates there.
    is_served: bool,
    /// Where the page's dashboard listens.
    web: String,
    beside: Vec<Beside>,
}

impl Reader {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        for name in ["config", "experiments", "crates/tactus-record/tests/tables"] {
            copy(&repository(name), &folder.path().join(name));
        }
        let endpoint = free_endpoint();
        listen_at(&endpoint, folder.path());
        let status = tactus(folder.path(), &["status"]);
        assert!(
            status.code != Some(0),
            "a service runs on this machine, and the page's commands would command its rig: stop it first"
        );
        let web = free_endpoint().replace("tcp/", "");
        Self { folder, endpoint, is_served: false, web, beside: Vec::new() }
    }

    /// A shell in the folder that finds this build's programs and the page's service.
    fn shell(&self, text: &str) -> Command {
        let programs = binary("tactus").parent().unwrap().to_owned();
        let path =
            env::join_paths([programs].into_iter().chain(env::split_paths(&env::var_os("PATH").unwrap())));
        let mut shell = Command::new("bash");
        shell.args(["-euo", "pipefail", "-c", text]).current_dir(self.folder.path()).stdin(Stdio::null());
        shell.env("PATH", path.unwrap()).env("XDG_STATE_HOME", self.folder.path().join("state"));
        shell.env_remove("STATE_DIRECTORY").env_remove("TACTUS_ENDPOINT").env_remove("RUST_LOG");
        shell.env("TACTUS_WEB_LISTEN", &self.web);
        if self.is_served {
            shell.env("TACTUS_ENDPOINT", &self.endpoint);
        }
        shell
    }

    /// Runs a block to its end and returns what it prints.
    fn run(&self, block: &Block, place: &str) -> String {
        let Output { status, stdout, stderr } = self.shell(&block.text).output().unwrap();
        let printed = format!("{}{}", String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
        let expected: i32 = block.word("exit").map_or(0, |code| code.parse().unwrap());
        assert_eq!(status.code(), Some(expected), "{place}:\n{}\nprinted:\n{printed}", block.text);
        printed
    }

    /// Starts a block, and returns when it has printed `text`.
    fn start(&mut self, block: &str, text: &str, place: &str) {
        self.is_served |= block.starts_with("tactusd") || block.contains("--live");
        // One process, which can be ended.
        let mut command = self.shell(&format!("exec {block}"));
        let (reader, writer) = io::pipe().unwrap();
        command.stdin(Stdio::piped()).stdout(writer.try_clone().unwrap()).stderr(writer);
        let child = command.spawn().unwrap();
        // Its output ends with it.
        drop(command);
        self.beside.push(Beside(child));
        let (told, lines) = mpsc::channel();
        thread::spawn(move || {
            let lines = BufReader::new(reader).lines().map_while(Result::ok);
            // The process goes on when nobody waits for its lines any more.
            lines.for_each(|line| drop(told.send(line)));
        });
        let mut seen = Vec::new();
        loop {
            let line = lines.recv_timeout(DEADLINE).unwrap_or_else(|_| {
                panic!("{place}: {block} never printed {text:?}, but:\n{}", seen.join("\n"));
            });
            if line.contains(text) {
                return;
            }
            seen.push(line);
        }
    }

    /// Puts a block's keys into a file, in place of those that it has.
    fn put(&self, block: &Block, place: &str) {
        let path = self.folder.path().join(block.word("in").unwrap());
        let mut file: Table = fs::read_to_string(&path).unwrap().parse().unwrap();
        let keys: Table = block.text.parse().unwrap_or_else(|error| panic!("{place}: {error}"));
        file.extend(keys);
        fs::write(&path, file.to_string()).unwrap();
    }
}

/// A process that ends with the page.
struct Beside(Child);

impl Drop for Beside {
    fn drop(&mut self) {
        // It may have ended already.
        if self.0.kill().is_ok() {
            drop(self.0.wait());
        }
    }
}

/// Every line of a `text` block must be in what was printed, in this order.
fn check_printed(expected: &str, printed: &str, place: &str) {
    let mut rest = printed;
    for part in expected.lines().flat_map(|line| line.split("...")).map(str::trim) {
        let at = rest
            .find(part)
            .unwrap_or_else(|| panic!("{place}: {part:?} is not in what was printed:\n{printed}"));
        rest = &rest[at + part.len()..];
    }
}

/// The shipped configurations of services, at an endpoint of the page's own.
fn listen_at(endpoint: &str, folder: &Path) {
    for name in ["tactusd.toml", "tactusd-pty.toml"] {
        let path = folder.join("config").join(name);
        let mut config: Table = fs::read_to_string(&path).unwrap().parse().unwrap();
        let bus = config.entry("bus").or_insert_with(|| Table::new().into()).as_table_mut().unwrap();
        bus.insert("listen".into(), vec![endpoint.to_owned()].into());
        fs::write(&path, config.to_string()).unwrap();
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &to);
        } else {
            io::copy(&mut File::open(entry.path()).unwrap(), &mut File::create(to).unwrap()).unwrap();
        }
    }
}
