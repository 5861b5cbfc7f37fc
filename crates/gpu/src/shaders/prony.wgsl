// Relaxation of stresses, twin of prony.rs: h = d h + g (Φ − Φ⁻), S = (1 − Σ a) Φ + Σ h. The history lies in
// packs of sixteen cells, number by number.

fn remembered(place: u32) -> Symmetric {
    return Symmetric(
        vec3f(history[place], history[place + 16u], history[place + 32u]),
        vec3f(history[place + 48u], history[place + 64u], history[place + 80u]),
    );
}

fn remember(place: u32, s: Symmetric) {
    history[place] = s.diagonal.x;
    history[place + 16u] = s.diagonal.y;
    history[place + 32u] = s.diagonal.z;
    history[place + 48u] = s.shear.x;
    history[place + 64u] = s.shear.y;
    history[place + 80u] = s.shear.z;
}

// The relaxed part of a cell's stress: `slot` is its first tensor of history, `remaining` 1 − Σ a, its terms
// are those from `first` on.
fn relaxed(elastic: Symmetric, cell: u32, slot: u32, remaining: f32, first: u32, terms: u32) -> Symmetric {
    if terms == 0u {
        return elastic;
    }
    var place = (cell / 16u * SLOTS + slot) * 96u + cell % 16u;
    let change = symmetric_plus_scaled(elastic, remembered(place), -1.0);
    remember(place, elastic);
    var stress = symmetric_scaled(elastic, remaining);
    for (var term = first; term < first + terms; term++) {
        place += 96u;
        let h = symmetric_plus_scaled(
            symmetric_scaled(change, solid.series[term].y), remembered(place), solid.series[term].x,
        );
        remember(place, h);
        stress = symmetric_sum(stress, h);
    }
    return stress;
}

fn relaxed_isochoric(elastic: Symmetric, cell: u32, slot: u32) -> Symmetric {
    return relaxed(elastic, cell, slot, solid.series[0].x, 1u, ISOCHORIC_TERMS);
}

// Both parts, one after the other in the history.
fn relaxed_stress(elastic: Split, cell: u32) -> Symmetric {
    let isochoric = relaxed_isochoric(elastic.isochoric, cell, 0u);
    let first = 1u + ISOCHORIC_TERMS;
    let slot = select(0u, first, ISOCHORIC_TERMS > 0u);
    let volumetric = relaxed(elastic.volumetric, cell, slot, solid.series[0].y, first, VOLUMETRIC_TERMS);
    return symmetric_sum(isochoric, volumetric);
}
