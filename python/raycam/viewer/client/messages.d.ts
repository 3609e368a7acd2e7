// Written by `python -m raycam.viewer.message_types`; change client_messages.py instead.

/** Starts a session, or resumes the session with this id. */
export interface Hello {
  type: "hello";
  width: number;
  height: number;
  ratio: number;
  session: string;
}

/** The space for the image in the client's window. */
export interface Size {
  type: "size";
  width: number;
  height: number;
  ratio: number;
}

/** The new camera pose, which the client computed. */
export interface Move {
  type: "move";
  seq: number;
  R: number[];
  C: number[];
  fx: number;
  pivot: number[];
}

/** Returns to the camera that the view started with. */
export interface Home {
  type: "home";
  seq: number;
}

/** Requests the ray of an image position, and the hit point with its object's bounds. */
export interface Locate {
  type: "locate";
  id: number;
  image: number;
  u: number;
  v: number;
}

/** Requests the heights of two positions above the ground, for walking. */
export interface Ground {
  type: "ground";
  id: number;
  begin: number[];
  end: number[];
  foot: number;
}

/** Looks through a camera of the world; an empty name keeps the pose as a free camera. */
export interface LookThrough {
  type: "camera";
  seq: number;
  name: string;
}

/** Shows several cameras of the world at once, or only the main view if the list is empty. */
export interface Panes {
  type: "panes";
  names: string[];
}

/** Requests the photograph of a camera of the world. */
export interface Photograph {
  type: "photograph";
  name: string;
}

/** Sets the world's time in seconds, and the animation (empty for the first animation). */
export interface Time {
  type: "time";
  t: number;
  animation: string;
}

/** Chooses a material variant; empty for the file's own materials. */
export interface Variant {
  type: "variant";
  name: string;
}

/** Frames the whole world from the present direction; a field of view of 0 degrees keeps the lens. */
export interface Framing {
  type: "framing";
  seq: number;
  zoom: number;
  fov: number;
}

/** Views the whole world from a side, with the camera's lens. */
export interface FromSide {
  type: "side";
  seq: number;
  name: "default" | "front" | "back" | "right" | "left" | "top" | "bottom" | "iso";
}

/** Sets the light, the ground and the background; angles are in degrees. */
export interface Look {
  type: "look";
  light: "own" | "default" | "studio" | "room" | "sun" | "sky";
  rotation: number;
  azimuth: number;
  elevation: number;
  ground: "auto" | "none" | "plain" | "shadow" | "color";
  ground_color: string;
  backdrop: "light" | "color" | "image";
  background: string;
}

/** Uses an uploaded image as the environment that lights the world, or as the background. */
export interface LookImage {
  type: "look_image";
  use: "light" | "background";
  file: string;
}

/** Restores the light, the ground and the background of the view's start. */
export interface RestoreLook {
  type: "restore_look";
}

/** Sets the world's up axis, and shows the whole world from the first camera's side. */
export interface TurnUp {
  type: "up";
  axis: "z" | "y";
}

/** Sets the intrinsics, in the camera's own pixels, and the lens model's coefficients. */
export interface Lens {
  type: "lens";
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  distortion: number[];
}

/** Sets the camera's location in metres and its angles in degrees. */
export interface Pose {
  type: "pose";
  location: number[];
  roll: number;
  pitch: number;
  yaw: number;
}

/** Chooses the lines that are drawn over the image. */
export interface Overlay {
  type: "overlay";
  cameras: boolean;
  explained: boolean;
  grid: boolean;
}

/** Draws the points of one of the world's lidars over the image; an empty name hides them. */
export interface Scan {
  type: "scan";
  lidar: string;
}

/** Changes one property of an object or a light. */
export interface Edit {
  type: "edit";
  kind: "object" | "light";
  number: number;
  key: "visible" | "color" | "move" | "turn" | "scale" | "strength" | "isolate" | "place" | "level" | "position" | "direction" | "add" | "remove";
  value: boolean | number | string | number[];
}

/** Changes one value of the material in one slot, or in all slots, of an object. */
export interface EditMaterial {
  type: "edit_material";
  number: number;
  slot: number;
  key: "color" | "roughness" | "metallic" | "emission";
  value: number | string;
}

/** Selects an object and its material slot; `tool` determines whether its outline and handles are shown. */
export interface Select {
  type: "select";
  number: number;
  slot: number;
  tool: "none" | "outline" | "move" | "turn" | "scale";
}

/** Selects a light, and shows handles that move it. */
export interface SelectLight {
  type: "select_light";
  number: number;
}

/** Replaces a texture of a material by an uploaded image, or removes it if `file` is empty. */
export interface Texture {
  type: "texture";
  number: number;
  slot: number;
  texture: "color" | "normal" | "roughness" | "metallic" | "emission";
  file: string;
}

/** Requests small images of the textures of a material. */
export interface Thumbnails {
  type: "thumbnails";
  number: number;
  slot: number;
}

/** Adds the present camera to the world, under a name (empty: "view"). */
export interface KeepCamera {
  type: "keep_camera";
  name: string;
}

/** Removes a camera of the world. */
export interface RemoveCamera {
  type: "remove_camera";
  name: string;
}

/** A drag of a handle between two image positions; one drag is one undo step. */
export interface Gizmo {
  type: "gizmo";
  handle: "x" | "y" | "z" | "all" | "floor";
  stroke: number;
  begin: number[];
  end: number[];
}

/** Undoes the last edit. */
export interface Undo {
  type: "undo";
}

/** Repeats the last undone edit. */
export interface Redo {
  type: "redo";
}

/** Chooses the channel that is shown. */
export interface Channel {
  type: "channel";
  name: "color" | "albedo" | "depth" | "distance" | "position" | "normal" | "normal_camera" | "shading_normal" | "shading_normal_camera" | "instance" | "category" | "triangle" | "barycentric" | "uv" | "material" | "coverage" | "alpha" | "shadow" | "transmittance" | "emission" | "direct" | "indirect" | "diffuse" | "specular" | "volume" | "roughness" | "metallic" | "nocs" | "projector_uv" | "error";
}

/** Sets exposure (stops) and view transform of the saved and the moving images. */
export interface Display {
  type: "display";
  exposure: number;
  view: "standard" | "agx" | "pbr_neutral";
}

/** Chooses the integrator of the still image. */
export interface Quality {
  type: "quality";
  integrator: "direct" | "path";
}

/** Requests the values of a pixel.

    If the image is out of date and its view is no longer stored, the request is not answered: the client repeats it
    with the next image.
     */
export interface Probe {
  type: "probe";
  id: number;
  image: number;
  u: number;
  v: number;
}

/** Requests the exact numbers of a part of the shown channel, of at most 65,536 pixels. */
export interface Tile {
  type: "tile";
  id: number;
  image: number;
  u: number;
  v: number;
  width: number;
  height: number;
}

/** Reports a clicked pixel to the callbacks of `Viewer.on_pick`. */
export interface Pick {
  type: "pick";
  image: number;
  u: number;
  v: number;
}

/** Reports the held pixel, which followers show; an empty list if no pixel is held. */
export interface Hold {
  type: "hold";
  pixel: number[];
}

/** Shows the leader's view, looks around independently, or takes the lead. */
export interface Follow {
  type: "follow";
  mode: "attach" | "detach" | "lead";
}

/** Requests the explanation of a pixel. */
export interface Explain {
  type: "explain";
  id: number;
  image: number;
  u: number;
  v: number;
}

/** Removes the rays of the explained pixel from the image. */
export interface Forget {
  type: "forget";
}

/** Requests a file of the still image or of the world. */
export interface Snapshot {
  type: "snapshot";
  format: "png" | "html" | "npz" | "glb" | "toml";
}

/** Requests a video: a turn around the pivot, or the world's own movement for 0 degrees. */
export interface Film {
  type: "film";
  seconds: number;
  degrees: number;
}

/** Stops the video that is being rendered. */
export interface Stop {
  type: "stop";
}

/** A piece of a dropped file; the pieces of a file come in order. */
export interface Upload {
  type: "upload";
  name: string;
  bytes: number;
  offset: number;
  data: string;
}

/** Opens an uploaded file as the world; `others` are models that are shown in the same world. */
export interface Open {
  type: "open";
  name: string;
  others: string[];
}

/** Requests the camera as text, or the command that renders the image. */
export interface Copy {
  type: "copy";
  format: "python" | "toml" | "command" | "opencv" | "colmap";
}

/** Confirms that an image arrived. */
export interface Acknowledge {
  type: "ack";
  picture: number;
}

/** Reports a new value of a control that the script added; the value of a button is ignored. */
export interface Control {
  type: "control";
  id: number;
  value: boolean | number | string;
}

/** Chooses whether still images are sent as exact numbers or only for display. */
export interface Planes {
  type: "planes";
  wanted: boolean;
}

/** Reports whether the page is visible; hidden pages receive no images. */
export interface Visible {
  type: "visible";
  visible: boolean;
}

/** Any message of a client. */
export type ClientMessage =
  Hello | Size | Move | Home | Locate | Ground | LookThrough | Panes | Photograph | Time | Variant |
  Framing | FromSide | Look | LookImage | RestoreLook | TurnUp | Lens | Pose | Overlay | Scan | Edit |
  EditMaterial | Select | SelectLight | Texture | Thumbnails | KeepCamera | RemoveCamera | Gizmo |
  Undo | Redo | Channel | Display | Quality | Probe | Tile | Pick | Hold | Follow | Explain | Forget |
  Snapshot | Film | Stop | Upload | Open | Copy | Acknowledge | Control | Planes | Visible;
