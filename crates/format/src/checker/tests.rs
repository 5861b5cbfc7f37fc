use std::collections::BTreeMap;

use serde::Deserialize;

use pliant_testing::Random;

use super::*;

/// A law of the tests.
#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
struct Law {
    /// Shear modulus at rest [Pa].
    ///
    /// Of the matrix alone.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    shear_modulus: f64,
    /// Poisson's ratio [1].
    #[serde(default = "poisson")]
    #[schemars(range(min = 0.0, max = 0.5))]
    poisson_ratio: f64,
    /// Direction of the fibres.
    #[serde(default)]
    fibre: Option<Fibre>,
    /// Relaxation of the stress.
    #[serde(default)]
    prony: Vec<Term>,
}

fn poisson() -> f64 {
    0.45
}

/// One direction everywhere, or a field of the mesh.
#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Fibre {
    Same([f64; 3]),
    #[serde(rename_all = "kebab-case")]
    Field {
        cell_data: String,
    },
}

/// One term of a Prony series.
#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
struct Term {
    /// What relaxes.
    part: Part,
    /// Share of the stress that relaxes [1].
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    weight: f64,
}

#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Part {
    Isochoric,
    /// Rarely used.
    Volumetric,
    Whole,
}

#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Auto {
    Auto,
}

#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Step {
    Auto(Auto),
    Seconds(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
}

/// Which nodes of a body.
#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Nodes {
    All,
    /// Two corners [m].
    Box([[f64; 3]; 2]),
    Sphere {
        /// Centre [m].
        centre: [f64; 3],
        /// Radius [m].
        radius: f64,
    },
    Set(String),
    Indices(Vec<u32>),
}

#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Motion {
    By([f64; 3]),
    To([f64; 3]),
}

#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "kebab-case")]
enum Curve {
    Ramp { over: f64 },
    Sine { period: f64 },
}

/// Interval of time.
#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
struct Timing {
    /// From this time on [s].
    #[serde(default)]
    from: f64,
    /// Time step [s].
    #[serde(default)]
    step: Option<Step>,
}

#[derive(Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
struct Move {
    body: String,
    nodes: Nodes,
    #[serde(flatten)]
    motion: Motion,
    #[serde(flatten)]
    timing: Timing,
    #[serde(default)]
    curve: Option<Curve>,
    #[serde(default)]
    enabled: Option<bool>,
    #[serde(default)]
    threads: Option<u32>,
    #[serde(default)]
    small: Option<f32>,
    #[serde(default)]
    probes: BTreeMap<String, f64>,
    #[serde(default)]
    table: Vec<(f64, f64)>,
    #[serde(default)]
    #[schemars(length(min = 1, max = 2))]
    data: Vec<Part>,
    #[serde(default)]
    anything: Option<Json>,
}

/// Reads table `t`; returns its value, and each mistake as its message, the underlined text and its help.
fn read<T: DeserializeOwned + JsonSchema>(text: &str) -> (Option<T>, Vec<[String; 3]>) {
    let source = Source::parse("scene.toml", text).unwrap_or_else(|errors| panic!("{}", errors.plain()));
    let mut out = Vec::new();
    let read = read_table(&source, &["t"], &["type"], &mut out);
    let found = |d: Diagnostic| [d.message, text[d.span.unwrap()].to_owned(), d.help.unwrap_or_default()];
    (read, out.into_iter().map(found).collect())
}

#[track_caller]
fn expect<T: DeserializeOwned + JsonSchema>(text: &str, mistakes: &[[&str; 3]]) {
    let (read, found) = read::<T>(text);
    assert_eq!(found, mistakes);
    assert_eq!(read.is_none(), !mistakes.is_empty());
}

const LAW: &str = "[t]\ntype = 'neo-hookean'\nshear-modulus = 3e3\n";
const SHEAR: &str = "`shear-modulus`: Shear modulus at rest [Pa].";
const MOVE: &str = "[t]\nbody = 'liver'\nby = [0, 0, 1]\n";

fn law(lines: &str) -> String {
    format!("{LAW}{lines}\n")
}

fn moving(lines: &str) -> String {
    format!("{MOVE}nodes = 'all'\n{lines}\n")
}

#[test]
fn what_is_right_is_read_with_its_defaults() {
    let (law, found) = read::<Law>(
        "[t]\ntype = 'x'\nshear-modulus = 3000\nfibre = [0, 1, 0]\n\
         prony = [{ part = 'isochoric', weight = 0.5 }]\n",
    );
    assert_eq!(found, [[""; 3]; 0]);
    let term = Term { part: Part::Isochoric, weight: 0.5 };
    let fibre = Some(Fibre::Same([0.0, 1.0, 0.0]));
    assert_eq!(law, Some(Law { shear_modulus: 3000.0, poisson_ratio: 0.45, fibre, prony: vec![term] }));
    let (step, found) = read::<Move>(
        "[t]\nbody = 'liver'\nnodes = { sphere = { centre = [0, 0, 0], radius = 0.1 } }\nto = [0, 0, 1]\n\
         step = 'auto'\nfrom = 1\ncurve = { type = 'ramp', over = 2 }\nenabled = true\nthreads = 4\n\
         probes = { a = 1 }\ntable = [[0, 0], [1, 1.5]]\nanything = { x = [1, 'a'] }\n",
    );
    assert_eq!(found, [[""; 3]; 0]);
    let step = step.unwrap();
    assert_eq!(step.motion, Motion::To([0.0, 0.0, 1.0]));
    assert_eq!(step.timing, Timing { from: 1.0, step: Some(Step::Auto(Auto::Auto)) });
    assert_eq!(step.curve, Some(Curve::Ramp { over: 2.0 }));
    assert_eq!(step.table, [(0.0, 0.0), (1.0, 1.5)]);
}

#[test]
fn an_unknown_key_is_underlined_with_the_nearest_known_one() {
    expect::<Law>(
        "[t]\nshear-modulos = 3e3\n",
        &[["unknown key `shear-modulos` in `t`", "shear-modulos", "did you mean `shear-modulus`?"]],
    );
    expect::<Law>(
        &law("colour = 'red'"),
        &[[
            "unknown key `colour` in `t`",
            "colour",
            "known keys: `shear-modulus`, `poisson-ratio`, `fibre`, `prony`",
        ]],
    );
    // The nearest one is there already.
    expect::<Law>(
        &law("shear-moduls = 3"),
        &[[
            "unknown key `shear-moduls` in `t`",
            "shear-moduls",
            "known keys: `shear-modulus`, `poisson-ratio`, `fibre`, `prony`",
        ]],
    );
    expect::<Law>(
        "[t]\ntyp = 'x'\nshear-modulus = 1\n",
        &[["unknown key `typ` in `t`", "typ", "did you mean `type`?"]],
    );
    expect::<Law>(
        &law("prony = [{ part = 'whole', weight = 0.5, tau = 1 }]"),
        &[["unknown key `tau` in `t.prony[0]`", "tau", "known keys: `part`, `weight`"]],
    );
}

#[test]
fn a_missing_key_is_shown_at_the_header_or_the_table() {
    expect::<Law>(
        "[t]\ntype = 'x'\n",
        &[["missing key `shear-modulus` in `t`", "[t]", &format!("{SHEAR} (a number)")]],
    );
    expect::<Law>(
        &law("prony = [{}]"),
        &[[
            "missing keys `part`, `weight` in `t.prony[0]`",
            "{}",
            "`part`: What relaxes. (one of \"isochoric\", \"whole\", \"volumetric\")\n\
             `weight`: Share of the stress that relaxes [1]. (a number)",
        ]],
    );
    // The whole table is missing: the empty place at the beginning of the file.
    expect::<Law>("", &[["missing key `shear-modulus` in `t`", "", &format!("{SHEAR} (a number)")]]);
}

#[test]
fn a_wrong_kind_says_what_was_expected_and_found() {
    let shear = |value: &str| format!("[t]\nshear-modulus = {value}\n");
    expect::<Law>(
        &shear("\"3\""),
        &[[
            "`t.shear-modulus`: expected a number [Pa], found the text \"3\"",
            "\"3\"",
            &format!("remove the quotes: 3\n{SHEAR}"),
        ]],
    );
    expect::<Law>(
        &shear("\"soft\""),
        &[["`t.shear-modulus`: expected a number [Pa], found the text \"soft\"", "\"soft\"", SHEAR]],
    );
    for (value, found) in [
        ("true", "true"),
        ("[1]", "an array of 1 value"),
        ("{ a = 1 }", "a table"),
        ("1979-05-27", "the date or time 1979-05-27"),
    ] {
        let message = format!("`t.shear-modulus`: expected a number [Pa], found {found}");
        expect::<Law>(&shear(value), &[[&message, value, SHEAR]]);
    }
    expect::<Move>(
        &moving("enabled = 'true'"),
        &[[
            "`t.enabled`: expected true or false, found the text \"true\"",
            "'true'",
            "remove the quotes: true",
        ]],
    );
    expect::<Move>(
        "[t]\nbody = 3\nnodes = 'all'\nby = [0, 0, 0]\n",
        &[["`t.body`: expected a text, found 3", "3", "put a text in quotes"]],
    );
    expect::<Law>(
        "t = 3\n",
        &[["`t`: expected { shear-modulus = … }, found 3", "3", "`t`: A law of the tests."]],
    );
}

#[test]
fn a_number_out_of_its_range_says_the_range() {
    expect::<Law>(
        "[t]\nshear-modulus = -3\n",
        &[["`t.shear-modulus` must be greater than 0, found -3", "-3", SHEAR]],
    );
    expect::<Law>(
        "[t]\nshear-modulus = 0.0\n",
        &[["`t.shear-modulus` must be greater than 0, found 0", "0.0", SHEAR]],
    );
    expect::<Law>(
        &law("poisson-ratio = 0.7"),
        &[[
            "`t.poisson-ratio` must be at least 0 and at most 0.5, found 0.7",
            "0.7",
            "`poisson-ratio`: Poisson's ratio [1].",
        ]],
    );
    expect::<Law>(
        &law("prony = [{ part = 'whole', weight = 1 }]"),
        &[[
            "`t.prony[0].weight` must be greater than 0 and less than 1, found 1",
            "1",
            "`weight`: Share of the stress that relaxes [1].",
        ]],
    );
    expect::<Move>(&moving("threads = -1"), &[["`t.threads` must be at least 0, found -1", "-1", ""]]);
    expect::<Move>(
        &moving("threads = 5000000000"),
        &[["`t.threads` must be at most 4294967295, found 5000000000", "5000000000", ""]],
    );
    expect::<Move>(
        &moving("small = 1e300"),
        &[["`t.small` must be at most 3.4028234663852886e38, found 1e300", "1e300", ""]],
    );
    expect::<Move>(
        &moving("step = 0"),
        &[["`t.step` must be greater than 0, found 0", "0", "`step`: Time step [s]."]],
    );
}

#[test]
fn whole_numbers_are_numbers_but_not_the_other_way_round() {
    expect::<Law>(&law("poisson-ratio = 0"), &[]);
    expect::<Move>(
        &moving("threads = 4.0"),
        &[["`t.threads`: expected a whole number, found 4", "4.0", "write 4 without a point"]],
    );
    expect::<Move>(
        &moving("threads = 4.5"),
        &[["`t.threads`: expected a whole number, found 4.5", "4.5", ""]],
    );
}

#[test]
fn numbers_that_are_not_finite_are_always_mistakes() {
    expect::<Law>(
        "[t]\nshear-modulus = nan\n",
        &[["`t.shear-modulus`: nan is not a finite number", "nan", SHEAR]],
    );
    expect::<Law>(
        "[t]\nshear-modulus = +inf\n",
        &[["`t.shear-modulus`: inf is not a finite number", "+inf", SHEAR]],
    );
    expect::<Move>(
        &moving("anything = { x = [-inf] }"),
        &[["`t.anything.x[0]`: -inf is not a finite number", "-inf", ""]],
    );
}

#[test]
fn arrays_of_a_wrong_length_or_with_wrong_items() {
    let direction = "`fibre`: Direction of the fibres.";
    expect::<Move>(
        "[t]\nbody = 'x'\nnodes = 'all'\nby = [0, 1]\n",
        &[["`t.by`: expected 3 numbers, found 2", "[0, 1]", ""]],
    );
    expect::<Law>(&law("fibre = [0, 1]"), &[["`t.fibre`: expected 3 numbers, found 2", "[0, 1]", direction]]);
    expect::<Law>(
        &law("fibre = [0, 'x', 0]"),
        &[["`t.fibre[1]`: expected a number, found the text \"x\"", "'x'", direction]],
    );
    expect::<Move>(
        &format!("{MOVE}nodes = {{ box = [[0, 0, 0]] }}\n"),
        &[["`t.nodes.box`: expected 2 arrays of 3 numbers, found 1", "[[0, 0, 0]]", ""]],
    );
    expect::<Move>(
        &moving("table = [[0, 0], [1]]"),
        &[["`t.table[1]`: expected 2 numbers, found 1", "[1]", ""]],
    );
    expect::<Move>(
        &moving("data = []"),
        &[[
            "`t.data`: expected an array of 1 to 2 texts (\"isochoric\", \"whole\" or \"volumetric\"), found 0",
            "[]",
            "",
        ]],
    );
    expect::<Move>(
        &format!("{MOVE}nodes = {{ indices = [1, -2] }}\n"),
        &[["`t.nodes.indices[1]` must be at least 0, found -2", "-2", ""]],
    );
}

#[test]
fn unknown_words_come_with_the_nearest_and_the_list() {
    let expected = "expected one of \"isochoric\", \"whole\", \"volumetric\"";
    expect::<Move>(
        &moving("data = ['isocoric']"),
        &[[
            &format!("`t.data[0]`: {expected}, found the text \"isocoric\""),
            "'isocoric'",
            "did you mean \"isochoric\"?",
        ]],
    );
    expect::<Move>(
        &moving("data = ['x']"),
        &[[&format!("`t.data[0]`: {expected}, found the text \"x\""), "'x'", ""]],
    );
}

#[test]
fn a_choice_takes_exactly_one_of_its_keys() {
    let nodes = |value: &str| format!("{MOVE}nodes = {value}\n");
    let exactly = "give exactly one of `box`, `sphere`, `set`, `indices`";
    let expected = "expected \"all\", { box = … }, { sphere = … }, { set = … } or { indices = … }";
    let doc = "`nodes`: Which nodes of a body.";
    expect::<Move>(
        &nodes("{}"),
        &[["`t.nodes`: one of `box`, `sphere`, `set`, `indices` is missing", "{}", exactly]],
    );
    expect::<Move>(
        &nodes("{ spere = 1 }"),
        &[["unknown key `spere` in `t.nodes`", "spere", &format!("did you mean `sphere`?\n{exactly}")]],
    );
    expect::<Move>(
        &nodes("{ set = 'a', box = 1 }"),
        &[["`t.nodes`: `set`, `box` cannot be given together", "box", exactly]],
    );
    expect::<Move>(
        &nodes("{ set = 'a', colour = 1 }"),
        &[["unknown key `colour` in `t.nodes`", "colour", "known keys: `set`"]],
    );
    expect::<Move>(
        &nodes("'set'"),
        &[[
            &format!("`t.nodes`: {expected}, found the text \"set\""),
            "'set'",
            &format!("`set` needs a value: write {{ set = … }}\n{doc}"),
        ]],
    );
    expect::<Move>(
        &nodes("'al'"),
        &[[
            &format!("`t.nodes`: {expected}, found the text \"al\""),
            "'al'",
            &format!("did you mean \"all\"?\n{doc}"),
        ]],
    );
    expect::<Move>(&nodes("3"), &[[&format!("`t.nodes`: {expected}, found 3"), "3", doc]]);
    expect::<Move>(
        &nodes("{ all = true }"),
        &[["unknown key `all` in `t.nodes`", "all", &format!("write \"all\" instead of a table\n{exactly}")]],
    );
    expect::<Move>(
        &nodes("{ sphere = { centre = [0, 0, 0] } }"),
        &[[
            "missing key `radius` in `t.nodes.sphere`",
            "{ centre = [0, 0, 0] }",
            "`radius`: Radius [m]. (a number)",
        ]],
    );
}

#[test]
fn a_flattened_choice_is_checked_among_the_other_keys() {
    let by_or_to = "give exactly one of `by`, `to`";
    expect::<Move>(
        "[t]\nbody = 'x'\nnodes = 'all'\n",
        &[["`t`: one of `by`, `to` is missing", "[t]", by_or_to]],
    );
    expect::<Move>(
        &moving("to = [0, 0, 0]"),
        &[["`t`: `by`, `to` cannot be given together", "to", by_or_to]],
    );
    expect::<Move>(&moving("stepp = 1"), &[["unknown key `stepp` in `t`", "stepp", "did you mean `step`?"]]);
}

#[test]
fn a_choice_with_a_tag_is_checked_by_it() {
    expect::<Move>(
        &moving("curve = { type = 'rmp', over = 1 }"),
        &[[
            "`t.curve.type`: expected one of \"ramp\", \"sine\", found the text \"rmp\"",
            "'rmp'",
            "did you mean \"ramp\"?",
        ]],
    );
    expect::<Move>(
        &moving("curve = { over = 1 }"),
        &[["missing key `type` in `t.curve`", "{ over = 1 }", "`type` is one of ramp, sine"]],
    );
    expect::<Move>(
        &moving("curve = { type = 'sine', over = 1 }"),
        &[
            ["unknown key `over` in `t.curve`", "over", "known keys: `type`, `period`"],
            ["missing key `period` in `t.curve`", "{ type = 'sine', over = 1 }", "`period`: a number"],
        ],
    );
}

#[test]
fn alternatives_without_a_tag_give_one_message() {
    let step = "`step`: Time step [s].";
    expect::<Move>(
        &moving("step = true"),
        &[["`t.step`: expected \"auto\" or a number [s], found true", "true", step]],
    );
    expect::<Move>(
        &moving("step = 'atuo'"),
        &[[
            "`t.step`: expected \"auto\" or a number [s], found the text \"atuo\"",
            "'atuo'",
            &format!("did you mean \"auto\"?\n{step}"),
        ]],
    );
    expect::<Law>(
        &law("fibre = 'x'"),
        &[[
            "`t.fibre`: expected 3 numbers or { cell-data = … }, found the text \"x\"",
            "'x'",
            "`fibre`: Direction of the fibres.",
        ]],
    );
    expect::<Law>(
        &law("fibre = { cel-data = 'x' }"),
        &[["unknown key `cel-data` in `t.fibre`", "cel-data", "did you mean `cell-data`?"]],
    );
}

#[test]
fn all_mistakes_of_a_table_are_reported() {
    let text = "[t]\nshear-modulus = -1\npoisson-ration = 0.3\nfibre = [1, 2]\nprony = [{ weight = nan }]\n";
    let (_, found) = read::<Law>(text);
    let places: Vec<&str> = found.iter().map(|mistake| mistake[1].as_str()).collect();
    assert_eq!(places, ["-1", "poisson-ration", "[1, 2]", "nan", "{ weight = nan }"]);
}

#[test]
fn what_the_command_line_gave_is_not_looked_for_in_the_file() {
    let mut source = Source::parse("scene.toml", LAW).unwrap();
    source.set(&["t", "shear-modulus"], -1.0).unwrap();
    source.set(&["t", "shaer"], 2).unwrap();
    let mut out = Vec::new();
    assert_eq!(read_table::<Law>(&source, &["t"], &["type"], &mut out), None);
    let found: Vec<_> = out.iter().map(|d| (d.message.as_str(), d.span.clone())).collect();
    assert_eq!(
        found,
        [
            ("`t.shear-modulus` must be greater than 0, found -1 (given on the command line)", None),
            ("unknown key `shaer` in `t` (given on the command line)", None)
        ]
    );
}

#[test]
fn the_whole_file_can_be_one_table() {
    let source = Source::parse("scene.toml", "shear-modulus = 'x'\ncolour = 1\n").unwrap();
    let mut out = Vec::new();
    assert_eq!(read_table::<Law>(&source, &[], &[], &mut out), None);
    assert!(out[0].message.starts_with("`shear-modulus`: expected a number [Pa]"), "{out:?}");
    assert_eq!(out[1].message, "unknown key `colour`");
}

#[test]
fn what_only_serde_knows_is_reported_at_the_table() {
    #[derive(Debug, Deserialize, JsonSchema)]
    #[serde(try_from = "String")]
    #[allow(dead_code)]
    struct Even(String);
    impl TryFrom<String> for Even {
        type Error = String;
        fn try_from(text: String) -> Result<Self, String> {
            if text.len().is_multiple_of(2) { Ok(Self(text)) } else { Err("odd".to_owned()) }
        }
    }
    #[derive(Debug, Deserialize, JsonSchema)]
    #[allow(dead_code)]
    struct Holder {
        even: Even,
    }
    expect::<Holder>("[t]\neven = 'abc'\n", &[["`t`: odd", "[t]", ""]]);
}

#[test]
fn the_unit_is_what_stands_in_the_last_brackets() {
    assert_eq!(unit(Some("Shear modulus [Pa].")), "Pa");
    assert_eq!(unit(Some("In [0, 1], a rate [1/s]")), "1/s");
    assert_eq!(unit(Some("See [`Law`] and [this](x.md); in [0, 1]")), "");
    assert_eq!(unit(Some("A ratio [1]")), "");
    assert_eq!(unit(Some("open [kg")), "");
    assert_eq!(unit(None), "");
}

#[test]
fn a_damaged_scene_is_never_a_panic() {
    let text = "[t]\nbody = 'liver'\nnodes = { sphere = { centre = [0, 0, 0], radius = 0.1 } }\nto = [0, 0, 1]\n\
                step = 'auto'\nfrom = 1\ncurve = { type = 'ramp', over = 2 }\nenabled = true\nthreads = 4\n\
                probes.a = 1\ntable = [[0, 0], [1, 1.5e3]] # µm\nanything = { x = [1, \"ä\"] }\n\
                [[t.more]]\nx = 1979-05-27\n";
    let handler = miette::GraphicalReportHandler::new_themed(miette::GraphicalTheme::unicode_nocolor());
    let mut random = Random::new(1);
    let mut next = |limit: usize| random.below(limit);
    let alphabet = b"[]{}=.'\"\n,#-09einfau\xc3\xa4\\ ";
    for round in 0..4000 {
        let mut bytes = text.as_bytes().to_vec();
        for _ in 0..1 + next(4) {
            let at = next(bytes.len());
            match next(4) {
                0 => bytes[at] ^= 1 << next(8),
                1 => bytes[at] = alphabet[next(alphabet.len())],
                2 => drop(bytes.remove(at)),
                _ => bytes.insert(at, alphabet[next(alphabet.len())]),
            }
        }
        let damaged = String::from_utf8_lossy(&bytes).into_owned();
        let errors = Source::parse("scene.toml", damaged).map(|source| {
            let mut out = Vec::new();
            let read: Option<Move> = read_table(&source, &["t"], &["type", "more"], &mut out);
            assert_eq!(read.is_none(), !out.is_empty());
            source.errors(out)
        });
        let (Ok(errors) | Err(errors)) = errors;
        let _ = errors.plain().to_string();
        if round % 8 == 0 {
            let mut page = String::new();
            handler.render_report(&mut page, &errors).unwrap();
            assert!(!page.contains("Failed to read"), "{page}");
        }
    }
}
