//! Claims of the literature, a module each. They are one program, so that shared code is compiled once and
//! slow tests of all modules run at the same time.

mod brain_in_skull;
mod brain_shift;
mod contact_reference;
mod coupling;
mod critical_step;
mod cube_compression;
mod determinism;
mod elements;
mod energy_balance;
mod failures;
mod immersed_hexes;
mod lens_bag;
mod loads;
mod mass_scaling;
mod material_points;
mod momentum;
mod niftysim;
mod organ_meshes;
mod palpation;
mod quasi_static;
mod shell_balloon;
mod shell_fits;
mod shell_large_rotation;
mod shell_linear;
mod shell_organs;
mod shell_pressure;
mod shell_scenes;
mod simple_shear;
mod stability;
mod stress_relaxation;
mod uniaxial_stress;
