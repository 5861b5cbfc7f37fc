// The relaxed pressure U′ at a change of volume.
fn relaxed_pressure(volume_change: f32, index: u32) -> f32 {
    let elastic = law_pressure(volume_change);
    if VOLUMETRIC_TERMS == 0u {
        return elastic;
    }
    var place = index / 16u * (1u + VOLUMETRIC_TERMS) * 16u + index % 16u;
    let change = elastic - pressures[place];
    pressures[place] = elastic;
    var pressure = elastic * solid.series[0].y;
    for (var term = 1u + ISOCHORIC_TERMS; term < 1u + ISOCHORIC_TERMS + VOLUMETRIC_TERMS; term++) {
        place += 16u;
        let h = fma(pressures[place], solid.series[term].x, change * solid.series[term].y);
        pressures[place] = h;
        pressure += h;
    }
    return pressure;
}
