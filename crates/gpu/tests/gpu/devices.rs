//! Finding and opening adapters.

use pliant_gpu::{Device, GpuError, adapters};

use crate::support;

#[test]
fn an_adapter_opens_by_a_part_of_its_name_and_is_sound() {
    let Some(device) = support::device() else { return };
    assert!(device.check().is_ok() && device.wait().is_ok());
    let best = adapters().remove(0);
    assert_eq!(device.adapter(), &best);
    let part: String = best.name.chars().take(4).collect::<String>().to_uppercase();
    assert!(Device::open(Some(&part)).is_ok());
}

#[test]
fn an_unknown_name_is_told_with_those_there_are() {
    let Some(device) = support::device() else { return };
    match Device::open(Some("no such adapter")) {
        Err(GpuError::UnknownAdapter { found, .. }) => assert!(found.contains(&device.adapter().name)),
        other => panic!("{other:?}"),
    }
}
