use super::*;

/// A square of cells in the plane z = 0 facing up (or down), corners at whole places.
fn square(cells: u32, up: bool, first: u32) -> (Surface, Vec<Vector3<f64>>) {
    let node = |i: u32, j: u32| first + j * (cells + 1) + i;
    let mut faces = Vec::new();
    for (i, j) in (0..cells).flat_map(|j| (0..cells).map(move |i| (i, j))) {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        faces.extend(if up { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
    }
    let places = (0..(cells + 1) * (cells + 1))
        .map(|k| Vector3::new(f64::from(k % (cells + 1)), f64::from(k / (cells + 1)), 0.0));
    (Surface { nodes: (first..first + (cells + 1) * (cells + 1)).collect(), faces }, places.collect())
}

fn found(pairs: &Pairs, places: &[Vector3<f64>]) -> Vec<Pair> {
    let mut collected = Vec::new();
    pairs.find(|node| places[node as usize], |pair| collected.push(pair));
    collected
}

/// Two sheets that face each other, shifted. Distances and normals are the values of the planes, and weights
/// give the way between the points. Lists hold while nodes move by less than half of the skin.
#[test]
fn sheets_that_face_each_other_are_seen_with_their_distance() {
    let (low, mut places) = square(3, true, 0);
    let (high, above) = square(3, false, 16);
    places.extend(above.iter().map(|x| x + Vector3::new(0.3, 0.2, 0.1)));
    let mut pairs = Pairs::new(&low, Some(&high), 0.0, |node| places[node as usize]);
    pairs.update(|node| places[node as usize]);
    for height in [0.1, 0.05, -0.02] {
        places[16..].iter_mut().for_each(|place| place.z = height);
        pairs.update(|node| places[node as usize]);
        let touching = found(&pairs, &places);
        let [points, edges] =
            [true, false].map(|of| touching.iter().filter(|p| (p.weights[0] == 1.0) == of).count());
        assert!(points >= 18 && edges >= 10, "{points} {edges}");
        for pair in touching {
            // The pair of a node outside a border has its distance from the border.
            if pair.normal.z.abs() < 0.9 {
                assert!(pair.distance > 0.19, "{pair:?}");
                continue;
            }
            let sum = pair.weights.iter().sum::<f64>();
            let way = (0..4).map(|k| places[pair.nodes[k] as usize] * pair.weights[k]).sum::<Vector3<f64>>();
            let up = if pair.nodes[0] < 16 { -1.0 } else { 1.0 };
            assert!((pair.normal - Vector3::z() * up).norm() < 1e-12 && sum.abs() < 1e-12, "{pair:?}");
            assert!((pair.distance - height).abs() < 1e-12, "{pair:?}");
            assert!((way - pair.normal * pair.distance).norm() < 1e-12, "{pair:?}");
            assert_eq!(pair.in_order, pair.nodes[0] < 16);
        }
    }
    // Seen from behind, there is nothing to touch.
    places[16..].iter_mut().for_each(|place| place.z = -0.9);
    pairs.update(|node| places[node as usize]);
    assert!(found(&pairs, &places).is_empty());
}

/// A sheet begins askew above another one, at its lower side nearer than both keep. Nodes there keep the
/// distance that they have, so that no pair is pushed apart. Other nodes keep the whole distance.
#[test]
fn what_is_nearer_at_the_start_keeps_that_distance() {
    let (low, mut places) = square(6, true, 0);
    let (high, above) = square(4, false, 49);
    places.extend(above.iter().map(|x| x + Vector3::new(0.3, 0.2, 0.01 + 0.1 * x.x)));
    let rest = places.clone();
    let place = |node: u32| rest[node as usize];
    let fresh = || Pairs::new(&low, Some(&high), 0.2, place);
    let near = fresh().nearer(place);
    assert!(near.len() > 10 && near.len() < 50, "{near:?}");
    assert!(near.iter().all(|(_, kept)| (0.0..0.2).contains(kept)), "{near:?}");
    let mut pairs = fresh().keeping(near, place);
    pairs.update(place);
    let touching = found(&pairs, &places);
    assert!(touching.iter().all(|pair| pair.distance > pair.kept - 1e-12), "{touching:?}");
    let [whole, part] =
        [true, false].map(|whole| touching.iter().filter(|p| (p.kept == 0.2) == whole).count());
    assert!(whole > 3 && part > 10, "{whole} {part}");
    // The distance that is kept changes evenly along triangles: a sheet that slides is not pushed at once.
    let (mut before, mut least): (Option<f64>, f64) = (None, f64::INFINITY);
    for step in 0..400 {
        let slid = |node: u32| {
            let by = if node < 49 { 0.0 } else { 0.005 * f64::from(step) };
            rest[node as usize] - Vector3::x() * by
        };
        pairs.update(slid);
        let mut kept = f64::INFINITY;
        pairs.find(slid, |pair| {
            if pair.nodes[0] == 61 && pair.normal.z > 0.99 {
                kept = kept.min(pair.kept);
            }
        });
        assert!(before.is_none_or(|before| (kept - before).abs() < 0.01), "{step}: {before:?} {kept}");
        (before, least) = (Some(kept), least.min(kept));
    }
    assert!(least < 0.1, "{least}");
}

/// Pairs at some places are the same, to the last bit, from lists made at these places and from lists with a
/// larger skin.
#[test]
fn pairs_do_not_depend_on_when_lists_are_made() {
    let (low, mut rest) = square(6, true, 0);
    let (high, above) = square(5, false, 49);
    rest.extend(above.iter().map(|x| x + Vector3::new(0.3, 0.4, 0.1)));
    let mut random = pliant_testing::Random::new(3);
    rest.iter_mut().for_each(|x| *x += 0.3 * Vector3::from_fn(|_, _| random.half()));
    let faces = [&low, &high].iter().flat_map(|one| one.faces.clone()).collect();
    let both = Surface { nodes: (0..rest.len() as u32).collect(), faces };
    for (first, second) in [(&low, Some(&high)), (&both, None)] {
        let apart = |node: u32| rest[node as usize] + Vector3::z() * if node < 49 { 0.0 } else { 3.0 };
        let fresh = || Pairs::new(first, second, 0.01, apart);
        let (mut held, mut wide) = (fresh(), fresh());
        wide.skin *= 4.0;
        let (mut lists, mut pair_count) = (0, 0);
        for step in 0..300 {
            let time = 0.01 * f64::from(step);
            let wave = |x: &Vector3<f64>| {
                Vector3::new(0.5 * time, 0.2 * (2.0 * time).sin(), 0.3 * (3.0 * time + x.x).cos() - 0.1)
            };
            let now = |node: u32| {
                let x = &rest[node as usize];
                if node < 49 { *x } else { x + wave(x) }
            };
            let bits = |pairs: &Pairs| {
                let mut found = Vec::new();
                pairs.find(now, |pair| {
                    let numbers = pair.weights.iter().chain(&pair.normal).chain([&pair.distance]);
                    found.push((pair.nodes, pair.in_order, numbers.map(|x| x.to_bits()).collect::<Vec<_>>()));
                });
                found
            };
            let before = held.sides[0].listed.clone();
            held.update(now);
            lists += u32::from(held.sides[0].listed != before);
            wide.update(now);
            let mut anew = fresh();
            anew.list_again(now);
            let wanted = bits(&anew);
            assert_eq!(bits(&held), wanted, "step {step}");
            assert_eq!(bits(&wide), wanted, "step {step}");
            pair_count += wanted.len();
        }
        println!("{pair_count} pairs in 300 steps, listed anew in {lists}");
        assert!(pair_count > 3000 && lists < 150, "{pair_count} {lists}");
    }
}

/// A corner that comes down on the border of a square is above the square. It makes no pair with the wall
/// beneath, which is in one plane with the corner's wall.
#[test]
fn walls_in_one_plane_do_not_touch() {
    // The upper side and the wall x = 0 of a block, and a corner with three sides that faces down and to −x.
    let mut places: Vec<Vector3<f64>> = [[0, 0, 0], [9, 0, 0], [9, 9, 0], [0, 9, 0], [0, 0, -9], [0, 9, -9]]
        .map(|x| x.map(f64::from).into())
        .to_vec();
    let block = Surface { nodes: (0..6).collect(), faces: vec![[0, 1, 2], [0, 2, 3], [4, 0, 3], [4, 3, 5]] };
    places.extend([[0.0, 4.0, 0.1], [3.0, 4.0, 0.1], [0.0, 4.0, 3.0], [0.0, 7.0, 3.0]].map(Vector3::from));
    let corner = Surface { nodes: (6..10).collect(), faces: vec![[6, 8, 9], [6, 7, 8], [6, 9, 7]] };
    // In the plane of the wall, and to rounding before or behind it; close to the border and farther away
    // from it.
    for (shift, height) in [0.0, 1e-15, -1e-15].into_iter().flat_map(|x| [(x, 0.1), (x, 0.4)]) {
        let mut places = places.clone();
        places[6..].iter_mut().for_each(|place| *place += Vector3::new(shift, 0.0, height));
        let mut pairs = Pairs::new(&block, Some(&corner), 1.0, |node| places[node as usize]);
        pairs.update(|node| places[node as usize]);
        let touching = found(&pairs, &places);
        let of_corner: Vec<&Pair> = touching.iter().filter(|pair| pair.nodes[0] == 6).collect();
        assert!(!of_corner.is_empty());
        assert!(of_corner.iter().all(|pair| pair.normal.z > 0.99 && pair.distance > 0.0), "{of_corner:?}");
    }
}

/// A sheet folded like a U touches itself across the fold only, not along it; the sides of a thin plate do
/// not touch through it.
#[test]
fn a_folded_sheet_touches_itself_across_the_fold_only() {
    let (sheet, flat) = square(8, true, 0);
    let fold = |x: &Vector3<f64>| {
        let (half, gap) = (4.0, 0.1);
        if x.x <= half { *x } else { Vector3::new(2.0 * half - x.x, x.y, gap) }
    };
    let mut pairs = Pairs::new(&sheet, None, 0.0, |node| flat[node as usize]);
    assert_eq!(pairs.set_apart_count(), 0);
    pairs.update(|node| flat[node as usize]);
    assert!(found(&pairs, &flat).is_empty());
    let folded: Vec<Vector3<f64>> = flat.iter().map(fold).collect();
    pairs.update(|node| folded[node as usize]);
    let touching = found(&pairs, &folded);
    let across = touching.iter().filter(|pair| (pair.distance - 0.1).abs() < 1e-12).count();
    assert!(across > 40, "{across} of {}", touching.len());
    assert!(touching.iter().all(|pair| pair.distance > 0.0));
    // Too near at rest: they never touch, or keep what they have.
    let place = |node: u32| folded[node as usize];
    let pairs = Pairs::new(&sheet, None, 0.2, place);
    assert!(pairs.set_apart_count() > 40);
    let near = pairs.keeping([], place).nearer(place);
    let mut pairs = Pairs::new(&sheet, None, 0.2, place).keeping(near, place);
    assert_eq!(pairs.set_apart_count(), 0);
    pairs.update(place);
    let touching = found(&pairs, &folded);
    assert!(touching.iter().filter(|pair| (pair.kept - 0.1).abs() < 1e-12).count() > 40);
    assert!(touching.iter().all(|pair| pair.distance > pair.kept - 1e-12));
}
