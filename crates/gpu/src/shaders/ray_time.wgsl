// When the camera ray of the path that an invocation follows has left, in the time of the scene's
// motion. Only where MOTION is defined: elsewhere nothing has a time.

#import optics::motion

var<private> ray_time: f32 = MOTION_MIDDLE;
