//! `pliant-lab bench` through the real binary.

use serde_json::Value;

use crate::{Said, Workshop, has_gpu};

const KEYS: [&str; 17] = [
    "mesh",
    "cells",
    "element",
    "law",
    "precision",
    "threads",
    "adapter",
    "design",
    "ns_per_element_step",
    "elements_per_second",
    "bytes_per_element",
    "flops_per_element",
    "bandwidth_fraction",
    "flop_fraction",
    "critical_step",
    "real_time_factor",
    "seconds_per_second",
];

#[test]
fn the_list_names_every_row_in_a_line() {
    let output = Workshop::new("").lab(&["bench", "--list"]);
    assert_eq!(output.code, 0, "{}", output.err);
    for id in ["tet4-nh-55566", "hex8-ti-prony-27000-double-all", "hex8-nh-1000", "tet4-anp-ti-55566-all"] {
        assert_eq!(output.out.lines().filter(|line| line.split(' ').next() == Some(id)).count(), 1, "{id}");
    }
}

#[test]
fn a_row_has_the_promised_keys_with_numbers_that_agree() {
    let output = Workshop::new("").lab(&["bench", "--only", "hex8-nh-1000", "--repeats", "3", "--json"]);
    assert_eq!(output.code, 0, "{}", output.err);
    let report = output.json();
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 1);
    let row = rows[0].as_object().unwrap();
    assert!(KEYS.iter().all(|key| row.contains_key(*key)), "{row:?}");
    assert_eq!((row["cells"].as_u64(), row["threads"].as_u64()), (Some(1000), Some(1)));
    for (key, word) in [("element", "hex8"), ("law", "NH"), ("precision", "single"), ("design", "cpu")] {
        assert_eq!(row[key], word);
    }
    assert!(row["adapter"].as_str().is_some_and(|name| !name.is_empty()));
    let number = |key: &str| row[key].as_f64().filter(|x| x.is_finite() && *x > 0.0).expect(key);
    KEYS[8..].iter().for_each(|key| _ = number(key));
    let ns = number("ns_per_element_step");
    assert!(number("ns_least") <= ns && ns <= number("ns_most"));
    let same = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    same(number("elements_per_second"), 1e9 / ns);
    same(number("real_time_factor"), number("critical_step") / (1e-9 * ns * 1000.0));
    same(number("seconds_per_second"), 1.0 / number("real_time_factor"));
    let rates = &report["rates"][0];
    let share = |count: &str, rate: &str| number(count) / (1e-9 * ns) / rates[rate].as_f64().unwrap();
    same(number("bandwidth_fraction"), share("bytes_per_element", "copy"));
    same(number("flop_fraction"), share("flops_per_element", "single"));
    assert!(number("flop_fraction") < 1.0, "no step is faster than bare multiply-adds");
    assert_eq!(report["linear_cost"], Value::Array(Vec::new()), "one mesh shows no line");
}

#[test]
fn a_design_is_measured_on_the_device_and_named_with_it() {
    if !has_gpu() {
        return;
    }
    let best = pliant_gpu::adapters().remove(0);
    let output =
        Workshop::new("").lab(&["bench", "--only", "hex8-nh-27000-gather", "--repeats", "1", "--json"]);
    assert_eq!(output.code, 0, "{}", output.err);
    let report = output.json();
    let row = report["rows"][0].as_object().unwrap();
    assert!(KEYS.iter().all(|key| row.contains_key(*key)), "{row:?}");
    assert_eq!((&row["adapter"], &row["design"]), (&best.name.into(), &"gather".into()));
    assert!(row["threads"].is_null());
    assert!(row["bytes_per_element"].is_null() && row["flop_fraction"].is_null(), "{row:?}");
    assert!(report["device"]["launch"].as_f64().is_some_and(|seconds| seconds > 0.0), "{report}");
}

#[test]
#[cfg(target_os = "linux")]
fn designs_without_a_device_are_answered_with_the_packages() {
    // No adapter has Direct3D there.
    let workshop = Workshop::new("");
    let mut command = workshop.command(&["bench", "--designs", "--repeats", "1"]);
    let output: Said = command.env("WGPU_BACKEND", "dx12").output().expect("the binary starts").into();
    assert_eq!(output.code, 1, "{}", output.out);
    assert!(output.words().contains("mesa-vulkan-drivers"), "{}", output.err);
}

#[test]
fn lanes_are_chosen_by_word_and_missing_ones_are_refused() {
    let workshop = Workshop::new("");
    let run = |word: &str| {
        let row = [
            "bench",
            "--only",
            "hex8-nh-1000",
            "--repeats",
            "1",
            "--seconds",
            "0.01",
            "--json",
            "--lanes",
            word,
        ];
        workshop.lab(&row)
    };
    let output = run("plain");
    assert_eq!(output.code, 0, "{}", output.err);
    assert_eq!(output.json()["rows"][0]["lanes"], "plain");
    let foreign = if cfg!(target_arch = "x86_64") { "neon" } else { "avx512" };
    let output = run(foreign);
    assert_eq!(output.code, 2);
    assert!(
        output.words().contains(&format!("this processor has no `{foreign}` instructions")),
        "{}",
        output.err
    );
    assert!(output.words().contains("omit `--lanes`"), "{}", output.err);
    let output = run("mmx");
    assert_eq!(output.code, 2);
    assert!(output.err.contains("avx2"), "{}", output.err);
}

#[test]
fn several_rows_make_a_table_and_three_meshes_a_line() {
    let ids = ["hex8-nh-1000", "hex8-nh-4096", "hex8-nh-15625"].map(|id| ["--only", id]).concat();
    let workshop = Workshop::new("");
    workshop.write(
        "page.md",
        "# Page\n<!-- pliant-lab bench: start -->\nold\n<!-- pliant-lab bench: end -->\nmore\n",
    );
    let output = workshop.lab(&[&["bench", "--repeats", "1", "--table", "page.md"], ids.as_slice()].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    for mesh in ["cube-10", "cube-16", "cube-25"] {
        assert_eq!(
            output.out.lines().filter(|line| line.starts_with(&format!("| {mesh} "))).count(),
            1,
            "{mesh}"
        );
    }
    assert!(output.out.contains("3 of 1000 to 15625 elements"), "{}", output.out);
    let page = workshop.read("page.md");
    let (before, after) = page.split_once(output.out.trim_end()).expect("the same tables");
    assert_eq!(before, "# Page\n<!-- pliant-lab bench: start -->\n\n");
    assert_eq!(after, "\n\n<!-- pliant-lab bench: end -->\nmore\n");
}

#[test]
fn a_series_of_tissues_on_all_threads_leads_to_a_cube_in_real_time() {
    let ids = ["hex8-nh-1000-all", "hex8-nh-4096-all", "hex8-nh-15625-all"].map(|id| ["--only", id]).concat();
    let output = Workshop::new("").lab(&[&["bench", "--repeats", "1", "--json"], ids.as_slice()].concat());
    assert_eq!(output.code, 0, "{}", output.err);
    let report = output.json();
    let fit = &report["linear_cost"][0];
    let cost = fit["ns_per_element_step"].as_f64().unwrap();
    assert!(cost > 0.0 && fit["largest_deviation"].as_f64().unwrap() >= 0.0);
    let cubes = report["largest_real_time_cubes"].as_array().unwrap();
    assert_eq!(cubes.len(), 1);
    let predicted = cubes[0]["predicted"].as_f64().unwrap();
    // b n³ = d/n with d from the finest mesh.
    let d = 25.0 * report["rows"][2]["critical_step"].as_f64().unwrap();
    assert_eq!(predicted, (d / (1e-9 * cost)).powf(0.25).floor());
    assert!(KEYS.iter().all(|key| !cubes[0][*key].is_null()));
}

#[test]
fn an_unknown_row_is_answered_with_the_nearest() {
    let workshop = Workshop::new("");
    let output = workshop.lab(&["bench", "--only", "tet4-nh-5556", "--json"]);
    assert_eq!(output.code, 2);
    assert!(output.err.contains("did you mean `tet4-nh-55566`?"), "{}", output.err);
    assert!(output.out.contains("tet4-nh-5556"), "{}", output.out);
    let mistyped = workshop.lab(&["bench", "--json", "--ful"]);
    assert_eq!((mistyped.code, mistyped.json()["status"].as_str()), (2, Some("invalid")), "{}", mistyped.out);
    assert_eq!(workshop.lab(&["bench", "--repeats", "0"]).code, 2);
    assert_eq!(workshop.lab(&["bench", "--seconds", "0"]).code, 2);
    workshop.write("page.md", "# Page\n");
    let output = workshop.lab(&["bench", "--table", "page.md"]);
    assert_eq!(output.code, 2);
    assert!(output.words().contains("`page.md` has no place for the table"), "{}", output.err);
}
