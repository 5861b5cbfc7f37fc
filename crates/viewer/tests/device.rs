//! A scene on a GPU, played and drawn there: nothing comes back to ordinary memory but at the looks. Without
//! any the tests are skipped with a notice; with `PLIANT_REQUIRE_GPU=1` they fail.

mod support;

use std::time::Duration;

use pliant_format::tables::{ColourBy, FieldName, ViewTable};
use pliant_geometry::Vector3;
use pliant_picture::{Camera, Drawn, Plane, Renderer, Section, Style, Subject, Target};
use pliant_run::Live;
use pliant_scene::World;
use pliant_sim::gpu::{Device, DevicePoints, PointValue};
use pliant_testing::found_or_skipped;
use pliant_viewer::{Frame, Hand, Order, Point, Session};
use support::{BALL, subject, wait, world};

/// The ball on a GPU, pulled down, if there is one.
fn on_device() -> Option<World> {
    found_or_skipped(Device::open(None)).map(|_| world(&scene("gpu")))
}

fn scene(device: &str) -> String {
    BALL.replace("until = 100", "until = 100\ngravity = [0, 0, -9.81]")
        .replace("threads = 1", &format!("threads = 1\ndevice = '{device}'"))
}

/// Pictures off screen, on the solver's device.
struct Screen {
    device: Device,
    renderer: Renderer,
    drawn: Drawn,
    section: Section,
    picture: wgpu::Texture,
    depth: wgpu::TextureView,
    camera: Camera,
}

const SIZE: u32 = 64;

impl Screen {
    fn new(device: &Device, subject: &Subject) -> Self {
        let (gpu, _) = device.wgpu();
        let target = Target {
            format: wgpu::TextureFormat::Rgba8UnormSrgb,
            depth: wgpu::TextureFormat::Depth32Float,
            samples: 1,
        };
        let texture = |format, usage| {
            gpu.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let renderer = Renderer::new(gpu, target);
        let mut camera = Camera::default();
        camera.fit(&subject.points, 1.0);
        Self {
            device: device.clone(),
            drawn: Drawn::new(gpu, &renderer, subject),
            renderer,
            section: Section::default(),
            picture: texture(target.format, wgpu::TextureUsages::COPY_SRC),
            depth: texture(target.depth, wgpu::TextureUsages::empty()).create_view(&Default::default()),
            camera,
        }
    }

    fn bind(&mut self, points: &DevicePoints) {
        self.drawn.bind_positions(self.device.wgpu().0, &self.renderer, points.buffer());
    }

    fn draw(&mut self, style: &Style) {
        let (gpu, queue) = self.device.wgpu();
        let mut encoder = gpu.create_command_encoder(&Default::default());
        self.drawn.prepare(&self.renderer, queue, &mut encoder, &self.camera, style, 1.0);
        let view = self.picture.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        self.drawn.draw(&self.renderer, &mut pass, style);
        drop(pass);
        queue.submit([encoder.finish()]);
    }

    /// The picture last drawn.
    fn pixels(&self) -> Vec<u8> {
        let (gpu, queue) = self.device.wgpu();
        let read = gpu.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * SIZE * SIZE),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &read,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * SIZE),
                    rows_per_image: None,
                },
            },
            self.picture.size(),
        );
        queue.submit([encoder.finish()]);
        read.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("the picture can be read"));
        self.device.wait().unwrap();
        read.get_mapped_range(..).expect("the picture is mapped").to_vec()
    }
}

/// Positions and sizes of displacements in ordinary memory.
fn in_memory(live: &mut Live) -> (Vec<Vector3>, Vec<f64>) {
    let mesh = live.mesh().unwrap();
    let moved = mesh.point_data["displacement"].values.chunks_exact(3);
    let moved: Vec<_> = moved.map(|u| Vector3::new(u[0], u[1], u[2])).collect();
    let places = mesh.points.iter().zip(&moved).map(|(x, u)| x + u).collect();
    (places, moved.iter().map(|u| u.norm()).collect())
}

#[test]
fn thirty_frames_played_and_drawn_read_nothing_back_and_show_the_state() {
    let Some(world) = on_device() else { return };
    let device = world.device().cloned().unwrap();
    let mut live = Live::new(&std::sync::Arc::new(world.clone())).unwrap();
    let subject = Subject::new(live.mesh().unwrap());
    let mut screen = Screen::new(&device, &subject);
    let style = Style { range: Some([0.0, 0.02]), ..Style::default() };
    let before = device.read_backs();
    assert!(before > 0, "the first look counts");
    let mut bound = false;
    let mut steps = 0;
    // A quarter of a second, as between two looks.
    for _ in 0..30 {
        steps += live
            .simulation
            .on_device()
            .unwrap()
            .advance_without_read_back(8, Duration::from_secs(1))
            .unwrap();
        let points = live.place(PointValue::Size, None).unwrap().unwrap();
        if !std::mem::replace(&mut bound, true) {
            screen.bind(&points);
        }
        screen.draw(&style);
    }
    device.wait().unwrap();
    assert_eq!(device.read_backs(), before, "something came back");
    assert!(steps >= 30);
    let drawn = live.place(PointValue::Size, None).unwrap().unwrap().read().unwrap();
    let (places, sizes) = in_memory(&mut live);
    assert!(sizes.iter().any(|size| *size > 1e-4), "it moves");
    assert_eq!(drawn.len(), places.len());
    for ((drawn, place), size) in drawn.iter().zip(&places).zip(&sizes) {
        let [x, y, z, value] = drawn.map(f64::from);
        assert!((Vector3::new(x, y, z) - place).norm() < 1e-8, "{drawn:?} {place:?}");
        assert!((value - size).abs() < 1e-6 * size.max(1e-4));
    }
    assert!((live.simulation.time() - steps as f64 * world.step()).abs() < 1e-9);
}

#[test]
fn pictures_from_the_device_are_those_from_memory_with_and_without_a_section() {
    let Some(world) = on_device() else { return };
    let device = world.device().cloned().unwrap();
    let mut live = Live::new(&std::sync::Arc::new(world.clone())).unwrap();
    let subject = Subject::new(live.mesh().unwrap());
    let (mut one, mut other) = (Screen::new(&device, &subject), Screen::new(&device, &subject));
    while live.simulation.time() < 0.05 {
        live.simulation.on_device().unwrap().advance_without_read_back(100, Duration::from_secs(1)).unwrap();
    }
    let points = live.place(PointValue::Size, None).unwrap().unwrap();
    let (places, sizes) = in_memory(&mut live);
    let plain = Style { range: Some([0.0, 0.02]), edges: true, ..Style::default() };
    let plane = Plane { normal: Vector3::new(0.0, 1.0, 0.0), offset: 0.0 };
    let cut = Style { clip: Some(plane), ..plain };
    let (gpu, queue) = device.wgpu();
    one.drawn.set(queue, &places, &sizes);
    other.bind(&points);
    other.drawn.reach(&places);
    for screen in [&mut one, &mut other] {
        let Screen { drawn, renderer, section, .. } = screen;
        section.cut(&subject, &places, &sizes, &plane);
        // Room for the section is found anew.
        drawn.set_section(gpu, queue, renderer, section);
    }
    for style in [&plain, &cut, &plain] {
        one.draw(style);
        other.draw(style);
        let (a, b) = (one.pixels(), other.pixels());
        let differing = a.iter().zip(&b).filter(|(a, b)| a.abs_diff(**b) > 2).count();
        assert!(differing < a.len() / 500, "{differing} of {} bytes differ", a.len());
        let covered = a.chunks_exact(4).filter(|pixel| pixel[3] == 255).count();
        assert!(covered > (SIZE * SIZE / 20) as usize, "{covered} pixels are covered");
    }
}

/// Collects the frames of a session until a number of inspections is reached.
fn frames(session: &mut Session, inspections: u64) -> Vec<Frame> {
    let mut frames = Vec::new();
    let first = wait(session, |frame| frame.playing).inspections;
    loop {
        let (new, frame) = session.look();
        if new {
            assert_eq!(frame.failure, None);
            frames.push(frame.clone());
            if frame.inspections >= first + inspections {
                return frames;
            }
        }
        assert!(!session.has_ended(), "the solver's thread has ended");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_session_reads_back_at_its_looks_and_at_no_frame_between() {
    let Some(world) = on_device() else { return };
    let device = world.device().cloned().unwrap();
    let view = world.scene.view.clone();
    let subject = subject(&world);
    let mut screen = Screen::new(&device, &subject);
    let mut session = Session::start(world, || ()).unwrap();
    // Slowly, so that any machine keeps up.
    session.order(Order::Speed(0.02));
    session.order(Order::Play(true));
    let frames = frames(&mut session, 5);
    let style = Style::default();
    let mut between = 0;
    for pair in frames.windows(2) {
        screen.bind(pair[1].on_device.as_ref().expect("points on the device"));
        screen.draw(&style);
        assert!(pair[1].time >= pair[0].time);
        if pair[0].inspections == pair[1].inspections {
            assert_eq!(pair[0].read_backs, pair[1].read_backs, "frame {} read back", pair[1].number);
            between += 1;
        } else {
            assert!(pair[1].read_backs > pair[0].read_backs);
        }
    }
    assert!(between >= 10, "only {between} frames between looks");
    assert!(frames.last().unwrap().steps > frames[0].steps);
    // A section needs points in memory at every frame, a field other than displacements at the looks.
    session.order(Order::Memory(true));
    let colour = Some(ColourBy::Field(FieldName::VonMises));
    session.order(Order::Show(Box::new(ViewTable { colour, ..view })));
    let shown = wait(&mut session, |frame| frame.values.iter().any(|value| *value > 0.0));
    let next = wait(&mut session, |frame| frame.number > shown.number + 3);
    assert!(
        next.inspections >= shown.inspections + 3,
        "{} inspections in 4 frames",
        next.inspections - shown.inspections
    );
    session.order(Order::Play(false));
    let still = wait(&mut session, |frame| !frame.playing);
    let drawn = still.on_device.unwrap().read().unwrap();
    for ((drawn, place), value) in drawn.iter().zip(&still.points).zip(&still.values) {
        let [x, y, z, w] = drawn.map(f64::from);
        assert!((Vector3::new(x, y, z) - place).norm() < 1e-8);
        assert!((w - value).abs() <= 1e-6 * value.abs());
    }
}

#[test]
fn a_hand_pulls_on_the_device_as_on_the_processor() {
    let Some(on_device) = on_device() else { return };
    let on_processor = world(&scene("cpu"));
    assert_eq!(on_device.step(), on_processor.step());
    let held = [on_device, on_processor].map(|world| {
        let subject = subject(&world);
        let middle = |t: [u32; 3]| t.map(|p| subject.points[p as usize].x).iter().sum::<f64>();
        let (_, tip) = subject.triangles().map(middle).zip(0..).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        let mut session = Session::start(world, || ()).unwrap();
        session.order(Order::Step(20));
        session.order(Order::Hand(Hand::Take(Point { triangle: tip, weights: [0.5, 0.25, 0.25] }, 20.0)));
        session.order(Order::Step(20));
        let taken = wait(&mut session, |frame| frame.steps == 40);
        let place = Vector3::from(taken.held[0][0]) + Vector3::new(0.01, 0.0, 0.005);
        session.order(Order::Hand(Hand::Pull(place.into())));
        session.order(Order::Hand(Hand::Pin(Point { triangle: 0, weights: [0.5, 0.25, 0.25] })));
        session.order(Order::Step(100));
        wait(&mut session, |frame| frame.steps == 140).held.concat()
    });
    let [one, other] = held.map(|held| held.into_iter().map(Vector3::from).collect::<Vec<_>>());
    assert_eq!((one.len(), other.len()), (4, 4));
    let force = other[1].norm();
    assert!(force > 0.01, "{force} N");
    for (index, (a, b)) in one.iter().zip(&other).enumerate() {
        let size = if index % 2 == 0 { 0.05 } else { force };
        assert!((a - b).norm() < 1e-4 * size, "{a:?} {b:?}");
    }
}
