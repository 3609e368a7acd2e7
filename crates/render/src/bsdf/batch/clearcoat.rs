//! Clear coats of many points at once.

use crate::bsdf::batch::LaneContext;
use crate::lobes::clearcoat::Clearcoat;
use crate::lobes::ggx::Ggx;
use crate::soa::{LANES, Vec3xN, lane_vec3, set_lane};

/// Clear coats of all lanes whose materials have a clear coat.
#[derive(Debug, Default)]
pub(crate) struct ClearcoatLanes {
    pub is_active: [bool; LANES],
    pub any_active: bool,
    weight: [f32; LANES],
    alpha: [f32; LANES],
    /// Normals of the coats, bent towards the viewer.
    normals: Vec3xN<f32, LANES>,
}

impl ClearcoatLanes {
    #[inline]
    pub fn set(&mut self, lane: usize, coat: Option<&Clearcoat>) {
        self.is_active[lane] = coat.is_some();
        if let Some(coat) = coat {
            self.any_active = true;
            self.weight[lane] = coat.weight;
            self.alpha[lane] = coat.ggx.alpha_x;
            set_lane(&mut self.normals, lane, coat.frame.normal.to_array());
        }
    }

    #[inline(always)]
    pub fn get(&self, context: LaneContext, lane: usize) -> Clearcoat {
        let frame = context.interactions.shading_frame(lane);
        Clearcoat {
            weight: self.weight[lane],
            ggx: Ggx::from_alpha(self.alpha[lane]),
            frame: frame.with_axis(lane_vec3(&self.normals, lane)),
        }
    }
}
