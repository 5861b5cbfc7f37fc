//! Accuracy of the elements for nearly incompressible tissue, ν = 0.49. The cases are the cantilever under
//! its own weight and the glued cube at 20 %, as in `pliant-lab reproduce`. Prints the study's table.

use pliant_reproduce::cases::elements::{ELEMENTS, FORCE, TIP, force, percent_off, tip};
use pliant_validation::claim;

#[test]
fn cantilever_at_poisson_ratio_049_locks_plain_tets_and_no_others() {
    let off = ELEMENTS.map(|element| {
        let (tip, nodes) = tip(&element).unwrap();
        let off = percent_off(tip, TIP[0]);
        println!("cantilever, {}, {nodes} nodes: tip {tip:.2} mm ({off:+.1} %)", element.name);
        off
    });
    let [plain, nodal, _, uniform, _] = off;
    assert!(plain < -20.0, "plain tets are known to lock");
    claim("tet4-anp off by [%]", nodal.abs(), 8.0);
    claim("hex8 off by [%]", uniform.abs(), 1.0);
}

#[test]
fn cube_at_poisson_ratio_049_locks_plain_tets_and_no_others() {
    let off = ELEMENTS.map(|element| {
        let (force, nodes) = force(&element).unwrap();
        let off = percent_off(force, FORCE[0]);
        println!("cube, {}, {nodes} nodes: F {force:.3} N ({off:+.1} %)", element.name);
        off
    });
    let [plain, nodal, ..] = off;
    assert!(plain > 10.0, "plain tets are known to lock");
    claim("tet4-anp off by [%]", nodal.abs(), 5.5);
}
