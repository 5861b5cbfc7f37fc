//! The window: a scene played in real time on a thread of its own, pulled by hand and pinned, looked at from all sides. All but the
//! window itself works without one: [`Session`] plays, [`pick`] finds what lies under a pixel, [`replay()`] repeats what a hand did.

mod hand;
mod replay;
mod session;
#[cfg(feature = "window")]
mod window;

pub use hand::{Hand, Hold, Point, Recording, pick};
pub use replay::{Replayed, replay};
pub use session::{Frame, Order, Session, Stage};
#[cfg(feature = "window")]
pub use window::{Errand, Opening, WindowError, open};
