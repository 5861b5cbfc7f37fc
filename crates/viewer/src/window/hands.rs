//! Two hands. The mouse leads one, while the other keeps its grip or is led by keys.

use eframe::egui::Pos2;
use pliant_geometry::Vector3;

use super::App;
use super::picture::on_plane;
use crate::hand::{Hand, Point, Which};

impl App {
    /// The hand of the mouse takes hold of a point at a place [m]. A tool that keys lead stays in its hand.
    pub(super) fn grip(&mut self, point: Point, at: Vector3) {
        if self.is_led(self.mouse) {
            self.mouse = self.mouse.other();
        }
        if self.hands == [None; 2] {
            (self.mouse, self.strongest) = (Which::First, 0.0);
        }
        self.beside = Vector3::zeros();
        self.take_with(self.mouse, point, at);
    }

    /// A hand takes hold of a point at a place [m].
    pub(super) fn take_with(&mut self, which: Which, point: Point, at: Vector3) {
        self.hands[which as usize] = Some(at);
        self.act_with(which, Hand::Take(point, self.stiffness));
    }

    /// Takes over the grip of the other hand if it is shown at a place. Returns true if there is one.
    pub(super) fn take_kept(&mut self, place: Pos2) -> bool {
        let kept = self.mouse.other();
        let there = self.frame.hand(kept).is_some_and(|[point, _]| self.is_at(&point, place));
        let taken = there && self.hands[kept as usize].is_some() && !self.is_led(kept);
        if taken {
            self.lead(kept, place);
        }
        taken
    }

    /// The mouse leads a hand from a place on, without a jump.
    fn lead(&mut self, which: Which, place: Pos2) {
        self.mouse = which;
        if let Some(at) = self.hands[which as usize] {
            let place = self.port.in_picture(place);
            self.beside = at - on_plane(&self.port.camera, &at, place, self.port.aspect());
        }
    }

    /// Changes the hand that the mouse leads. A pulling hand keeps its grip, and the mouse leads the other
    /// one. If the mouse does not pull, the other hand lets go.
    pub(super) fn change_hands(&mut self) {
        let other = self.mouse.other();
        match self.context.pointer_latest_pos() {
            Some(_) if self.pulls() && self.is_led(other) => {}
            Some(place) if self.pulls() => self.lead(other, place),
            _ if self.hands[other as usize].is_some() && !self.is_led(other) => {
                self.hands[other as usize] = None;
                self.act_with(other, Hand::Release);
            }
            _ => {}
        }
    }

    /// Both hands have let go: the run has gone back, or starts anew.
    pub(super) fn let_go(&mut self) {
        (self.hands, self.led) = ([None; 2], None);
    }

    /// True if the mouse leads a hand that holds something.
    pub(super) fn pulls(&self) -> bool {
        self.hands[self.mouse as usize].is_some() && !self.is_led(self.mouse)
    }

    /// True if keys lead a tool in a hand.
    pub(super) fn is_led(&self, which: Which) -> bool {
        self.led.is_some_and(|(_, hand)| hand == which)
    }
}
