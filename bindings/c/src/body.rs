//! What a body may meet.

use crate::{Failure, sw_status::*};
use sapwise::Body;

/// What a body may meet. Initialise it with SW_BODY_DEFAULT.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_body {
    /// The groups of the body, one bit each. Default: all.
    pub groups: u32,
    /// The groups that it meets, one bit each. The masks of both bodies of a pair must allow the other. Default: all.
    pub masks: u32,
    /// What it is a part of, such as a ragdoll. Bodies with the same owner do not meet. 0: of nothing.
    pub owner: u32,
    /// SW_MOVING, SW_FIXED or SW_KINEMATIC. Two bodies of the latter two kinds do not meet.
    pub kind: u32,
    /// A number of yours, or a pointer, for sw_space_get.
    pub user_data: u64,
}

/// A body that moves.
pub const SW_MOVING: u32 = 0;
/// A body that rarely moves, such as a wall. It may be set all the same.
pub const SW_FIXED: u32 = 1;
/// A body that the program moves along a path, such as a lift.
pub const SW_KINEMATIC: u32 = 2;

impl sw_body {
    pub(crate) fn read(&self) -> Result<Body, Failure> {
        let body = match self.kind {
            SW_MOVING => Body::default(),
            SW_FIXED => Body::fixed(),
            SW_KINEMATIC => Body::kinematic(),
            kind => {
                let text = format_args!("the kind of the body is {kind}; use SW_MOVING, SW_FIXED or SW_KINEMATIC");
                return Err(Failure::new(SW_INVALID_ARGUMENT, text));
            }
        };
        Ok(body.groups(self.groups).masks(self.masks).owner(self.owner).user_data(self.user_data))
    }

    /// NULL is the default body.
    ///
    /// # Safety
    /// A pointer that is not NULL points to a body.
    pub(crate) unsafe fn or_default(this: *const Self) -> Result<Body, Failure> {
        // SAFETY: of the caller.
        unsafe { this.as_ref() }.map_or_else(|| Ok(Body::default()), Self::read)
    }
}

impl From<&Body> for sw_body {
    fn from(body: &Body) -> Self {
        let of = body.membership();
        let kind = match (of.fixed, body.is_kinematic()) {
            (false, _) => SW_MOVING,
            (true, false) => SW_FIXED,
            (true, true) => SW_KINEMATIC,
        };
        Self { groups: of.groups, masks: of.mask, owner: of.owner, kind, user_data: body.get_user_data() }
    }
}
