//! Scenes to start from: the small, commented scene of `pliant new`, a scene of a mesh, and a scene of an
//! organ with vessels and capsule.

mod of_mesh;
mod organ_scene;

pub use of_mesh::{SceneOfMesh, is_mesh, scene_of_given, scene_of_mesh};
pub use organ_scene::OrganScene;

/// The text of a starter scene with a title.
pub fn starter(name: &str) -> String {
    // A TOML string: the name of a folder may hold quotes.
    let title = serde_json::Value::from(name).to_string();
    include_str!("starter.toml").replace("\"TITLE\"", &title)
}
