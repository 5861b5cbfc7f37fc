//! Failures of runs that can't continue.

use std::thread;
use std::time::Duration;

use pliant_explicit::Wanted;
use pliant_explicit::{CentralDifference, State, StepError, critical_step};
use pliant_gpu::{Design, Device, GpuError, GpuStepper, StepFailure};
use pliant_mechanics::curve::{Curve, Shape};
use pliant_mechanics::law::samples::own;
use pliant_mechanics::load::{Load, LoadKind};
use pliant_mechanics::model::{Constraint, Model, Motion};

use super::against::{PLAIN, compare, designs, load, step_of, stepper};
use super::cube::{CELLS, EDGE, elastic, every_law, held_cube, layer, moved_cube, neo_hookean, smooth};
use crate::support;

#[test]
fn a_force_out_of_the_range_of_whole_numbers_is_told_and_never_wraps() {
    let Some(device) = support::device() else { return };
    let mut model = moved_cube("tet4", elastic(every_law().remove(9)));
    model.constraints[1].motion = Motion::Displacement([0.0, 0.0, 3.0 * EDGE], smooth(0.5));
    let mut state = State::<f32>::at_rest(&model);
    let mut stepper = stepper(&device, &model, 0.1 * step_of(&model), Design::Blocks);
    let error = stepper.advance(&mut state, 4000).expect_err("the force is too large");
    let StepFailure::Device(GpuError::Overflow { time, .. }) = &error else { panic!("{error:?}") };
    assert!(*time > 0.0 && *time == state.time, "{error}");
    assert!(state.displacement.as_flattened().iter().all(|u| u.is_finite()));
}

/// Runs on the processor until it fails.
pub(super) fn failure_of(model: &Model, step: f64) -> StepError {
    let mut state = State::<f32>::at_rest(model);
    let mut stepper = CentralDifference::new(model.clone(), step).unwrap();
    for _ in 0..2000 {
        if let Err(error) = stepper.evaluate(&mut state) {
            return error;
        }
        stepper.advance(&mut state);
    }
    panic!("it does not fail")
}

/// Runs on a device until it fails; the state then.
pub(super) fn failure_on(
    device: &Device,
    model: &Model,
    step: f64,
    design: Design,
) -> (StepFailure, State<f32>) {
    let mut state = State::<f32>::at_rest(model);
    let mut stepper = stepper(device, model, step, design);
    let error = stepper.advance(&mut state, 2000).expect_err("it fails");
    (error, state)
}

#[test]
fn an_inverted_cell_is_told_as_on_the_processor_though_it_lies_between_two_looks() {
    let Some(device) = support::device() else { return };
    // Slowly crushed, or at once: forces on the way to J = 0 are out of the range of whole numbers.
    let at_once = Curve { shape: Shape::Table(vec![(0.1, 0.0), (0.100_001, 1.0)]), from: 0.0, to: 0.0 };
    for (design, curve) in [(Design::Gather, smooth(0.3)), (Design::Blocks, at_once)] {
        for element in ["tet4", "tet4-anp", "hex8", "hex8-full"] {
            let mut model = held_cube(element, elastic(neo_hookean()));
            let motion = Motion::Displacement([0.0, 0.0, -1.2 * EDGE], curve.clone());
            let (name, nodes) = ("top".into(), layer(CELLS));
            model.constraints.push(Constraint { name, nodes, components: [true; 6], motion });
            let step = 0.5 * step_of(&model);
            let expected = failure_of(&model, step);
            let (error, state) = failure_on(&device, &model, step, design);
            let (
                StepError::Inverted { element: a, time, .. },
                StepFailure::Step(StepError::Inverted { element: b, .. }),
            ) = (&expected, &error)
            else {
                panic!("{element}, {design}: {expected:?}, {error:?}")
            };
            assert_eq!((a, *time), (b, state.time), "{element}, {design}: {error}");
        }
    }
}

#[test]
fn a_displacement_that_is_not_finite_is_told_with_its_node_and_an_unstable_run_as_unbalanced() {
    let Some(device) = support::device() else { return };
    let mut model = held_cube("tet4", elastic(neo_hookean()));
    let kind = LoadKind::Forces(vec![(layer(CELLS)[3], [0.0, 1e38, 0.0])]);
    let shape = Shape::Table(vec![(0.05, 0.0), (0.051, 1e10)]);
    model.loads.push(Load { curve: Curve { shape, from: 0.0, to: 0.0 }, ..load("pull", kind, None) });
    let step = step_of(&model);
    let (StepError::NotFinite { node: a, .. }, StepFailure::Step(StepError::NotFinite { node: b, .. })) =
        (failure_of(&model, step), failure_on(&device, &model, step, Design::Gather).0)
    else {
        panic!("{:?}, {:?}", failure_of(&model, step), failure_on(&device, &model, step, Design::Gather).0)
    };
    assert_eq!(a, b);
    let mut model = moved_cube("hex8", elastic(neo_hookean()));
    model.constraints[1].motion = Motion::Displacement([0.0, 0.0, 1e-4], smooth(0.2));
    let limit = critical_step::assembled(&model).unwrap().step;
    let (error, _) = failure_on(&device, &model, 1.02 * limit, Design::Gather);
    assert!(matches!(error, StepFailure::Step(_)), "{error:?}");
}

#[test]
fn contradictions_and_elements_without_their_law_are_refused_by_name() {
    let Some(device) = support::device() else { return };
    let mut model = moved_cube("tet4", elastic(neo_hookean()));
    model.constraints[1].nodes.push(0);
    let refused = GpuStepper::new(&device, model.clone(), 1e-3, None).err();
    assert!(matches!(refused, Some(GpuError::Contradiction(_))), "{refused:?}");
    let law = every_law().into_iter().find(|law| !law.has_volumetric_energy()).unwrap();
    for (element, law) in [("tet4-anp", law), ("tet4", own())] {
        let refused = GpuStepper::new(&device, moved_cube(element, elastic(law)), 1e-3, None).err();
        assert!(matches!(refused, Some(GpuError::Unsupported { .. })), "{refused:?}");
    }
}

/// The device as if it had less than it has.
fn lessened(lessen: impl FnOnce(&mut wgpu::Limits, &mut wgpu::Features)) -> Option<Device> {
    support::device()?;
    Some(Device::open_within(None, lessen).unwrap_or_else(|error| panic!("{error}")))
}

fn refusal(device: &Device, model: &Model, design: Design) -> GpuError {
    let error = GpuStepper::new(device, model.clone(), 1e-3, Some(design)).err().expect("it is refused");
    // Being refused leaves the device as it was.
    assert_eq!(device.check(), Ok(()));
    error
}

#[test]
fn a_model_too_large_for_a_buffer_is_refused_with_both_sizes() {
    const LIMIT: u64 = 16 << 10;
    let small = |limits: &mut wgpu::Limits, _: &mut _| limits.max_storage_buffer_binding_size = LIMIT;
    let Some(device) = lessened(small) else { return };
    let model = moved_cube("hex8-full", elastic(neo_hookean()));
    for design in designs(&device) {
        let error = refusal(&device, &model, design);
        let GpuError::TooLarge { needed, limit, .. } = &error else { panic!("{error:?}") };
        assert!(*limit == LIMIT && *needed > LIMIT, "{error}");
        assert!(error.remedy().contains("coarser mesh") && error.is_about_the_model());
    }
}

#[test]
fn what_a_device_lacks_is_named_with_what_it_has() {
    let cases: [(Lessen, Design, &str); 4] = [
        (
            |_, features| features.remove(wgpu::Features::SHADER_FLOAT32_ATOMIC),
            Design::FloatAtomics,
            "atomics",
        ),
        (
            |limits, _| limits.max_storage_buffers_per_shader_stage = 8,
            Design::Gather,
            "arrays per kernel (it has 8)",
        ),
        (|limits, _| limits.max_compute_invocations_per_workgroup = 64, Design::Gather, "it allows 64"),
        (|limits, _| limits.max_compute_workgroup_storage_size = 9000, Design::Fast, "it has 9000"),
    ];
    let model = moved_cube("tet4", elastic(neo_hookean()));
    for (lessen, design, named) in cases {
        let Some(device) = lessened(lessen) else { return };
        let error = refusal(&device, &model, design);
        let GpuError::Lacks { what, .. } = &error else { panic!("{error:?}") };
        assert!(what.contains(named), "{error}");
        assert!(error.remedy().contains("another design"));
    }
}

/// Reduction of a device's limits and features.
type Lessen = fn(&mut wgpu::Limits, &mut wgpu::Features);

#[test]
fn blocks_of_cells_shrink_to_the_groups_and_the_shared_memory_there_are() {
    let lessen: [Lessen; 2] = [
        |limits, _| limits.max_compute_invocations_per_workgroup = 128,
        |limits, _| limits.max_compute_workgroup_storage_size = 16_384,
    ];
    for lessen in lessen {
        let Some(device) = lessened(lessen) else { return };
        compare(&device, "in small groups", &moved_cube("tet4", elastic(neo_hookean())), &[Design::Fast]);
    }
}

#[test]
fn blocks_shrink_to_the_shared_memory_there_is_until_one_node_alone_is_too_much() {
    let share =
        |bytes| move |limits: &mut wgpu::Limits, _: &mut _| limits.max_compute_workgroup_storage_size = bytes;
    // Room for 85 nodes: of 125 in the cube, with up to 27 around each.
    let Some(device) = lessened(share(4096)) else { return };
    for element in ["tet4", "hex8"] {
        compare(&device, "in small blocks", &moved_cube(element, elastic(neo_hookean())), &[Design::Blocks]);
    }
    let Some(device) = lessened(share(3200)) else { return };
    let error = refusal(&device, &moved_cube("hex8", elastic(neo_hookean())), Design::Blocks);
    let GpuError::Crowded { neighbours, needed, limit, .. } = error else { panic!("{error:?}") };
    assert!(neighbours > 10 && needed > limit && limit == 3200, "{error}");
    assert!(error.remedy().contains("gather") && error.is_about_the_model());
}

/// Runs until it fails, with something happening meanwhile.
fn failure_while(happens: impl FnOnce(&Device) + Send, design: Design) -> Option<(Device, GpuError)> {
    let device = lessened(|_, _| {})?;
    let model = moved_cube("tet4", elastic(neo_hookean()));
    let mut state = State::<f32>::at_rest(&model);
    let mut stepper = stepper(&device, &model, step_of(&model), design);
    // It runs before anything happens, and would for long after.
    stepper.advance(&mut state, 10).unwrap_or_else(|error| panic!("{error}"));
    let failure = thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(Duration::from_millis(20));
            happens(&device);
        });
        stepper.advance(&mut state, 100_000_000).expect_err("it can't go on")
    });
    // Nor does it afterwards.
    for again in [stepper.evaluate(&mut state, Wanted::Everything), stepper.advance(&mut state, 10)] {
        assert_eq!(again, Err(failure.clone()));
    }
    stepper.upload(&state);
    assert_eq!(
        GpuStepper::new(&device, model.clone(), 1e-3, Some(design)).err().as_ref(),
        device.check().err().as_ref()
    );
    match failure {
        StepFailure::Device(error) => Some((device, error)),
        StepFailure::Step(error) => panic!("{error}"),
    }
}

#[test]
fn a_device_that_is_lost_in_the_middle_of_a_run_ends_it() {
    for &design in Design::ALL.iter().filter(|&&design| design != Design::FloatAtomics) {
        let Some((device, error)) = failure_while(|device| device.wgpu().0.destroy(), design) else { return };
        assert!(matches!(error, GpuError::Lost { .. }), "{error:?}");
        assert!(error.remedy().contains("--resume") && !error.is_about_the_model());
        assert!(device.wait().is_err());
    }
}

#[test]
fn memory_that_is_full_in_the_middle_of_a_run_ends_it() {
    let full = || wgpu::Error::OutOfMemory { source: "no room".into() };
    let Some((_, error)) = failure_while(move |device| device.report(&full()), Design::Gather) else {
        return;
    };
    let GpuError::OutOfMemory { needed, .. } = error else { panic!("{error:?}") };
    assert!(needed > 0, "{error}");
    assert!(error.remedy().contains("coarser mesh") && error.is_about_the_model());
}

#[test]
fn a_fault_in_the_use_of_a_device_ends_a_run() {
    let fault = |device: &Device| {
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::STORAGE;
        let size = device.wgpu().0.limits().max_buffer_size + 4;
        let descriptor = wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false };
        let _ = device.wgpu().0.create_buffer(&descriptor);
    };
    let Some((_, error)) = failure_while(fault, Design::Gather) else { return };
    assert!(matches!(error, GpuError::Internal { .. }), "{error:?}");
    assert!(error.remedy().contains("report this"));
}

#[test]
fn a_device_that_is_lost_before_a_run_takes_no_model() {
    let Some(device) = lessened(|_, _| {}) else { return };
    let model = moved_cube("tet4-anp", elastic(neo_hookean()));
    let mut state = State::<f32>::at_rest(&model);
    let mut begun = stepper(&device, &model, 1e-3, Design::Blocks);
    device.wgpu().0.destroy();
    let failure = begun.evaluate(&mut state, Wanted::Everything);
    assert!(matches!(failure, Err(StepFailure::Device(GpuError::Lost { .. }))), "{failure:?}");
    let refused = GpuStepper::new(&device, model.clone(), 1e-3, None).err();
    assert!(matches!(refused, Some(GpuError::Lost { .. })), "{refused:?}");
}

#[test]
fn a_stepper_takes_the_usual_design_of_its_kind_of_adapter() {
    let Some(device) = support::device() else { return };
    let model = moved_cube("tet4", elastic(neo_hookean()));
    let usual = GpuStepper::new(&device, model.clone(), 1e-3, None).map(|stepper| stepper.design());
    assert_eq!(usual, Ok(Design::usual(device.adapter().kind)));
    assert_eq!(PLAIN, [Design::usual(pliant_gpu::Kind::Software)]);
}
