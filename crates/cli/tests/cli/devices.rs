//! GPUs through the real binary: their list, and the error without a GPU.

use crate::support::{BLOCK, Said, Workshop, changed, has_gpu};

/// [`BLOCK`] on a device.
fn on(device: &str) -> Workshop {
    Workshop::new(&changed(BLOCK, "precision = \"double\"", device))
}

/// The message without an adapter: on Linux none answers to Direct3D.
fn without_adapters(workshop: &Workshop, arguments: &[&str]) -> Said {
    let mut command = workshop.command(arguments);
    command.env("WGPU_BACKEND", "dx12").output().expect("the binary starts").into()
}

#[test]
fn devices_are_listed_with_what_matters() {
    if !has_gpu() {
        return;
    }
    let workshop = Workshop::new(BLOCK);
    let best = pliant_gpu::adapters().remove(0);
    let output = workshop.pliant(&["devices"]);
    assert_eq!(output.code, 0, "{}", output.err);
    for piece in [best.name.as_str(), best.backend.as_str(), "MiB", "KiB"] {
        assert!(output.out.contains(piece), "no `{piece}` in:\n{}", output.out);
    }
    let json: serde_json::Value =
        serde_json::from_str(&workshop.pliant(&["devices", "--json"]).out).expect("JSON");
    assert_eq!(json[0]["name"], best.name);
    assert_eq!(json[0]["largest_buffer"], best.largest_buffer);
}

#[test]
#[cfg(target_os = "linux")]
fn without_an_adapter_the_packages_are_named_and_auto_runs_on_the_processor() {
    let output = without_adapters(&on("device = \"cpu\""), &["devices"]);
    assert_eq!(output.code, 0);
    assert!(output.out.contains("no GPU was found"), "{}", output.out);
    assert!(output.out.contains("mesa-vulkan-drivers"), "{}", output.out);

    let refused = without_adapters(&on("device = \"gpu\""), &["run", "case", "--json"]);
    assert_eq!(refused.code, 2, "{}", refused.err);
    assert!(refused.underlines("device = \"gpu\""), "{}", refused.err);
    assert!(refused.words().contains("mesa-vulkan-drivers"), "{}", refused.err);
    assert_eq!(refused.json()["error"]["kind"], "input");

    let ran = without_adapters(&on("device = \"auto\""), &["run", "case", "--json", "--step", "1e-3"]);
    let json = ran.done();
    assert_eq!((&json["device"], &json["precision"]), (&"cpu".into(), &"double".into()));
    assert!(ran.words().contains("it runs on the CPU"), "{}", ran.err);
}
