//! `pliant-lab reproduce` through the real binary.

use serde_json::Value;

use crate::Workshop;

#[test]
fn the_list_names_every_case_in_a_line() {
    let output = Workshop::new("").lab(&["reproduce", "--list"]);
    assert_eq!(output.code, 0, "{}", output.err);
    for id in [
        "fig-6.3",
        "fig-6.4",
        "fig-6.5",
        "fig-6.6",
        "fig-6.7",
        "fig-6.8",
        "fig-6.9",
        "fig-6.10",
        "elements",
        "brain-shift",
        "table-8.1",
        "fig-8.2",
        "fig-8.3",
        "fig-8.4",
        "obstacle-course",
        "fig-9.1",
        "fig-9.2",
        "fig-9.3",
        "fig-9.4",
        "fig-9.5",
    ] {
        assert_eq!(output.out.lines().filter(|line| line.split(' ').next() == Some(id)).count(), 1, "{id}");
    }
}

#[test]
fn a_case_leaves_a_page_and_its_numbers() {
    let workshop = Workshop::new("");
    let output = workshop.lab(&["reproduce", "--only", "fig-6.3", "--only", "fig-6.4", "--out", "shear"]);
    assert_eq!(output.code, 0, "{}{}", output.out, output.err);
    let results: Value = serde_json::from_str(&workshop.read("shear/results.json")).unwrap();
    let rows = results["rows"].as_array().unwrap();
    assert_eq!((rows.len(), results["failed"].as_u64()), (16, Some(0)));
    for row in rows {
        let keys: Vec<&str> = row.as_object().unwrap().keys().map(String::as_str).collect();
        let promised = ["id", "quantity", "unit", "reference", "computed", "tolerance", "pass", "source"];
        assert_eq!(keys, promised);
        assert_eq!(row["pass"], true, "{row}");
        let number = |key: &str| row[key].as_f64().unwrap();
        assert!((number("computed") - number("reference")).abs() <= number("tolerance"), "{row}");
    }
    let page = workshop.read("shear/index.html");
    assert!(page.ends_with("</html>\n") && page.matches("<svg").count() == 4);
    assert!(page.contains("All 16 judged numbers are within their tolerance."));
    for outside in ["src=", "http-equiv", "@import", "url("] {
        assert!(!page.contains(outside), "the page asks for something outside of it: {outside}");
    }
    let again = workshop.lab(&["reproduce", "--only", "fig-6.3", "--out", "shear"]);
    assert_eq!(again.code, 0, "an own folder may be written again: {}", again.err);
}

#[test]
fn a_folder_with_something_else_in_it_is_refused() {
    let workshop = Workshop::new("");
    let output = workshop.lab(&["reproduce", "--only", "fig-6.3", "--out", "case"]);
    assert_eq!(output.code, 2);
    assert!(output.words().contains("`case` cannot be written: it is not empty"), "{}", output.err);
    let forced = workshop.lab(&["reproduce", "--only", "fig-6.3", "--out", "case", "--force"]);
    assert_eq!(forced.code, 0, "{}", forced.err);
    assert!(workshop.path("case/scene.toml").exists() && workshop.path("case/index.html").exists());
}

#[test]
fn an_unknown_case_is_answered_with_the_nearest() {
    let workshop = Workshop::new("");
    let output = workshop.lab(&["reproduce", "--only", "fig-6.1O"]);
    assert_eq!(output.code, 2);
    assert!(output.words().contains("there is no case `fig-6.1O`"), "{}", output.err);
    assert!(output.words().contains("did you mean `fig-6.10`?"), "{}", output.err);
    assert!(!workshop.path("reproduce").exists(), "nothing is made");
}

#[test]
fn a_table_needs_its_marks() {
    let workshop = Workshop::new("");
    workshop.write("page.md", "# Validation\n");
    let output = workshop.lab(&["reproduce", "--table", "page.md"]);
    assert_eq!(output.code, 2);
    assert!(output.words().contains("`page.md` has no place for the table"), "{}", output.err);
}
