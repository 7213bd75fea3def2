use super::*;
use proptest::prelude::*;

fn problem(source: &str) -> String {
    match parse("s", source) {
        Ok(_) => String::from("accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn syntax_errors_tell_the_line() {
    for (source, wanted) in [
        ("x = 1\ny = (\n", "s.star:"),
        ("x = 1\nwhile True:\n    pass\n", "s.star:2:1: cannot use reserved keyword `while`"),
        ("load('a.star', 'b')\n", "s.star:1:1: `load` is not allowed"),
        ("import os\n", "s.star:1:1: cannot use reserved keyword `import`"),
        ("x = 2 ** 3\n", "s.star:1:7: unexpected symbol '**'"),
        ("x = f'{y}'\n", "s.star:1:5: "),
    ] {
        let problem = problem(source);
        assert!(problem.starts_with(wanted), "{source:?}: {problem}");
    }
}

#[test]
fn operations_that_no_function_can_stand_in_for_are_refused_with_what_to_write() {
    for (source, wanted) in [
        ("x = 'a'\nx *= 9\n", "s.star:2: `*=` is not available: write `a = a * b`"),
        ("x = 'a'\nif x:\n    x %= x\n", "s.star:3: `%=` is not available"),
        (
            "def f(a):\n    return [[a.extend(a) for _ in a]]\n",
            "s.star:2: `.extend()` is not available: write `a += b`",
        ),
        ("x = 'a'.replace\n", "s.star:1: `.replace()`"),
        ("x = lambda a: ','.join(a)\n", "s.star:1: `.join()`"),
        ("x = {'{}'.format(1): 2}\n", "s.star:1: `.format()`"),
    ] {
        let problem = problem(source);
        assert!(problem.starts_with(wanted), "{source:?}: {problem}");
    }
}

#[test]
fn deep_nesting_is_refused_before_it_is_parsed() {
    let many = 50_000;
    for source in [
        format!("x = {}1{}\n", "(".repeat(many), ")".repeat(many)),
        format!("x = {}{}\n", "[".repeat(many), "]".repeat(many)),
        format!("x = {}1\n", "-".repeat(many)),
        format!("x = {}1\n", "not ".repeat(many)),
        format!("x = 1{}\n", " + 1".repeat(many)),
        format!("x = f{}\n", "()".repeat(many)),
        format!("x = f{}\n", ".a".repeat(many)),
        format!("x = {}1\n", "lambda a, b: ".repeat(many / 3)),
        format!("x = {}1\n", "1 if 2 else ".repeat(many / 3)),
        format!("if 1:\n    pass\n{}", "elif 1:\n    pass\n".repeat(many / 5)),
        (0..500).fold(String::new(), |text, depth| text + &" ".repeat(depth) + "if 1:\n")
            + &" ".repeat(500)
            + "pass\n",
    ] {
        let problem = problem(&source);
        assert!(problem.contains("nested more than 150 deep"), "{}: {problem}", &source[..20]);
    }
}

#[test]
fn long_flat_sources_are_fine() {
    for source in [
        format!("x = [{}]\n", "-1, ".repeat(20_000)),
        format!("x = [{}]\n", "(1, -2),\n".repeat(10_000)),
        format!("x = f({})\n", "a + b, ".repeat(10_000)),
        "x = 1 + 1\n".repeat(10_000),
        format!("x = [lambda a, b: a + b, 1]\n{}", "# (((((\n".repeat(10_000)),
        "def f():\n    if 1:\n        pass\n    elif 2:\n        pass\n".repeat(1000),
    ] {
        assert_eq!(problem(&source), "accepted", "{}", &source[..20]);
    }
}

#[test]
fn the_deepest_allowed_nesting_fits_a_small_stack() {
    let deepest = [
        format!("x = {}1{}\n", "(".repeat(70), ")".repeat(70)),
        format!("x = {}1\n", "-".repeat(140)),
        format!("x = 1{}\n", " + 1".repeat(140)),
        format!("x = {}1\n", "lambda a, b: ".repeat(45)),
    ];
    // Threads have 2 MiB unless told otherwise.
    let thread = std::thread::Builder::new().stack_size(2 << 20);
    let parsed = thread.spawn(move || deepest.map(|source| problem(&source))).unwrap().join().unwrap();
    assert_eq!(parsed, ["accepted"; 4]);
}

#[test]
fn a_huge_source_is_refused() {
    assert!(problem(&"# \n".repeat(SOURCE_MAX_BYTES)).contains("the limit is 262144"));
}

/// What follows from an update of the language must be looked at: the bounds rest on these lists.
#[test]
fn the_language_has_no_other_methods_and_functions_than_those_looked_at() {
    use starlark::environment::{Globals, Module};
    use starlark::eval::Evaluator;
    let methods = |of: &str| {
        Module::with_temp_heap(|module| {
            let ast = AstModule::parse("m", format!("dir({of})"), &Dialect::Standard).unwrap();
            let value = Evaluator::new(&module).eval_module(ast, &Globals::standard()).unwrap();
            value.to_repr().replace(['"', '[', ']', ','], "")
        })
    };
    assert_eq!(
        methods("''"),
        "capitalize codepoints count elems endswith find format index isalnum isalpha isdigit islower isspace istitle \
         isupper join lower lstrip partition removeprefix removesuffix replace rfind rindex rpartition rsplit rstrip \
         split splitlines startswith strip title upper"
    );
    assert_eq!(methods("[]"), "append clear extend index insert pop remove");
    assert_eq!(methods("{}"), "clear get items keys pop popitem setdefault update values");
    let names: Vec<_> = GLOBALS.names().map(|name| name.as_str().to_owned()).collect();
    assert_eq!(
        names.join(" "),
        "% * + False None True abs all any atan2 bool cos covering dict dwell enumerate exp fail float int len list ln \
         log max min move param pi press range read reversed round shuffled sin sorted sqrt str sum tare tuple type \
         uniform wait zip |"
    );
}

const PIECES: [&str; 40] = [
    "x",
    "1",
    "2.5",
    "'a'",
    "\"",
    "'''",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    "=",
    "+",
    "*",
    "%",
    "-",
    "not ",
    " in ",
    ".",
    "def f(",
    "lambda ",
    "if ",
    "elif ",
    "else:",
    "for ",
    "return ",
    "\n",
    "\n    ",
    "\n        ",
    "\\",
    "#",
    ";",
    "|=",
    ".join",
    "\u{e9}",
    "\t",
    "\0",
];

proptest! {
    #[test]
    fn any_text_is_a_script_or_an_error_with_its_line(
        pieces in prop::collection::vec(prop::sample::select(&PIECES[..]), 0..80)
    ) {
        let source = pieces.concat();
        if let Err(error) = parse("s", &source) {
            let line = error.at().map_or(0, |at| at.line as usize);
            prop_assert!((1..=source.matches('\n').count() + 1).contains(&line), "{error}");
        }
    }
}
