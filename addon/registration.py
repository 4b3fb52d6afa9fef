"""Everything registered with Blender, in one list, undone in reverse."""

import bpy

from . import cli, left_over, older_files, preferences, running, translations
from .animate.keying_set import FacewrightFace
from .animate.operators import (
    FACEWRIGHT_OT_clear_keyframes,
    FACEWRIGHT_OT_expression,
    FACEWRIGHT_OT_insert_keyframes,
    FACEWRIGHT_OT_mirror_keys,
    FACEWRIGHT_OT_reset_keys,
)
from .animate.panel import FACEWRIGHT_PT_expressions, FACEWRIGHT_PT_keys
from .animate.properties import FacewrightKeys
from .calibrate import following
from .calibrate.operators import (
    FACEWRIGHT_OT_calibrate,
    FACEWRIGHT_OT_forget_camera,
    FACEWRIGHT_OT_open_camera,
    FACEWRIGHT_OT_remove_boards,
    FACEWRIGHT_OT_save_board,
    FACEWRIGHT_OT_save_calibration_picture,
    FACEWRIGHT_OT_save_camera,
    FACEWRIGHT_OT_set_clip_lens,
    FACEWRIGHT_OT_set_scene_camera,
    FACEWRIGHT_OT_show_boards,
)
from .calibrate.panel import (
    FACEWRIGHT_PT_board,
    FACEWRIGHT_PT_calibrated_scene,
    FACEWRIGHT_PT_camera,
    FACEWRIGHT_PT_lens,
    FACEWRIGHT_PT_pictures,
    FACEWRIGHT_UL_board_pictures,
    draw_clip_menu,
)
from .calibrate.properties import FacewrightBoardPicture, FacewrightCamera
from .clip.actions import stop_looking
from .clip.operators import (
    FACEWRIGHT_FH_clip,
    FACEWRIGHT_OT_frames_from_timeline,
    FACEWRIGHT_OT_open_clip,
    FACEWRIGHT_OT_open_recent_clip,
    FACEWRIGHT_OT_pick_frame,
    FACEWRIGHT_OT_survey,
    FACEWRIGHT_OT_use_all_frames,
)
from .clip.panel import FACEWRIGHT_MT_recent_clips, FACEWRIGHT_PT_frames
from .controls.operators import (
    FACEWRIGHT_OT_add_controls,
    FACEWRIGHT_OT_pose_controls,
    FACEWRIGHT_OT_remove_controls,
)
from .controls.panel import FACEWRIGHT_PT_controls
from .export.operators import FACEWRIGHT_OT_export
from .export.panel import FACEWRIGHT_PT_export, draw_export_menu
from .heads.operators import (
    FACEWRIGHT_OT_choose_head,
    FACEWRIGHT_OT_duplicate_head,
    FACEWRIGHT_OT_mark_head,
    FACEWRIGHT_OT_remove_head,
)
from .heads.panel import FACEWRIGHT_PT_heads, FACEWRIGHT_UL_heads
from .heads.properties import FacewrightHeads, title
from .help import links
from .help.operators import FACEWRIGHT_OT_manual, FACEWRIGHT_OT_open_report
from .help.panel import FACEWRIGHT_PT_first_steps, FACEWRIGHT_PT_help
from .motion.operators import (
    FACEWRIGHT_OT_length_from_selection,
    FACEWRIGHT_OT_look_through,
    FACEWRIGHT_OT_motion,
    FACEWRIGHT_OT_open_motion,
    FACEWRIGHT_OT_remove_motion,
    FACEWRIGHT_OT_save_motion,
)
from .motion.panel import FACEWRIGHT_PT_clip_motion, FACEWRIGHT_PT_motion
from .motion.panel import draw_clip_menu as draw_motion_menu
from .motion.properties import FacewrightMotion
from .person.properties import FacewrightPerson
from .preferences import FacewrightPreferences
from .reconstruct.operators import FACEWRIGHT_OT_reconstruct
from .reconstruct.panel import (
    FACEWRIGHT_PT_advanced,
    FACEWRIGHT_PT_clip,
    FACEWRIGHT_PT_report,
    draw_menu,
)
from .reconstruct.properties import FacewrightClip, FacewrightPicture
from .rig.operators import (
    FACEWRIGHT_OT_add_rig_folder,
    FACEWRIGHT_OT_calibrate_rig,
    FACEWRIGHT_OT_choose_rig_camera,
    FACEWRIGHT_OT_forget_rig,
    FACEWRIGHT_OT_open_rig,
    FACEWRIGHT_OT_remove_rig_folder,
    FACEWRIGHT_OT_save_rig,
)
from .rig.panel import FACEWRIGHT_PT_rig
from .rig.properties import FacewrightRig, FacewrightRigFolder
from .running import FACEWRIGHT_OT_dismiss
from .track.operators import (
    FACEWRIGHT_OT_open_tracks,
    FACEWRIGHT_OT_remove_tracks,
    FACEWRIGHT_OT_save_tracks,
    FACEWRIGHT_OT_track,
)
from .track.panel import (
    FACEWRIGHT_PT_track,
    FACEWRIGHT_PT_track_advanced,
    FACEWRIGHT_PT_tracks,
)
from .track.panel import draw_clip_menu as draw_track_menu
from .track.properties import FacewrightTrack

CLASSES: tuple[type, ...] = (
    FacewrightBoardPicture,
    FacewrightCamera,
    FacewrightRigFolder,
    FacewrightRig,
    FacewrightPerson,
    FacewrightPicture,
    FacewrightClip,
    FacewrightTrack,
    FacewrightMotion,
    FacewrightKeys,
    FACEWRIGHT_OT_dismiss,
    FacewrightHeads,
    FACEWRIGHT_OT_choose_head,
    FACEWRIGHT_OT_duplicate_head,
    FACEWRIGHT_OT_remove_head,
    FACEWRIGHT_OT_mark_head,
    FacewrightPreferences,
    FACEWRIGHT_OT_calibrate,
    FACEWRIGHT_OT_open_camera,
    FACEWRIGHT_OT_forget_camera,
    FACEWRIGHT_OT_save_camera,
    FACEWRIGHT_OT_save_calibration_picture,
    FACEWRIGHT_OT_save_board,
    FACEWRIGHT_OT_show_boards,
    FACEWRIGHT_OT_remove_boards,
    FACEWRIGHT_OT_set_scene_camera,
    FACEWRIGHT_OT_set_clip_lens,
    FACEWRIGHT_OT_add_rig_folder,
    FACEWRIGHT_OT_remove_rig_folder,
    FACEWRIGHT_OT_calibrate_rig,
    FACEWRIGHT_OT_open_rig,
    FACEWRIGHT_OT_save_rig,
    FACEWRIGHT_OT_forget_rig,
    FACEWRIGHT_OT_choose_rig_camera,
    FACEWRIGHT_OT_survey,
    FACEWRIGHT_OT_pick_frame,
    FACEWRIGHT_OT_frames_from_timeline,
    FACEWRIGHT_OT_use_all_frames,
    FACEWRIGHT_OT_open_clip,
    FACEWRIGHT_OT_open_recent_clip,
    FACEWRIGHT_FH_clip,
    FACEWRIGHT_MT_recent_clips,
    FACEWRIGHT_OT_reconstruct,
    FACEWRIGHT_OT_expression,
    FACEWRIGHT_OT_reset_keys,
    FACEWRIGHT_OT_mirror_keys,
    FACEWRIGHT_OT_insert_keyframes,
    FACEWRIGHT_OT_clear_keyframes,
    FacewrightFace,
    FACEWRIGHT_OT_add_controls,
    FACEWRIGHT_OT_remove_controls,
    FACEWRIGHT_OT_pose_controls,
    FACEWRIGHT_OT_export,
    FACEWRIGHT_OT_track,
    FACEWRIGHT_OT_open_tracks,
    FACEWRIGHT_OT_save_tracks,
    FACEWRIGHT_OT_remove_tracks,
    FACEWRIGHT_OT_motion,
    FACEWRIGHT_OT_open_motion,
    FACEWRIGHT_OT_save_motion,
    FACEWRIGHT_OT_remove_motion,
    FACEWRIGHT_OT_look_through,
    FACEWRIGHT_OT_length_from_selection,
    FACEWRIGHT_OT_manual,
    FACEWRIGHT_OT_open_report,
    FACEWRIGHT_UL_board_pictures,
    FACEWRIGHT_PT_camera,
    FACEWRIGHT_PT_board,
    FACEWRIGHT_PT_pictures,
    FACEWRIGHT_PT_calibrated_scene,
    FACEWRIGHT_PT_lens,
    FACEWRIGHT_PT_rig,
    FACEWRIGHT_UL_heads,
    FACEWRIGHT_PT_heads,
    FACEWRIGHT_PT_clip,
    FACEWRIGHT_PT_frames,
    FACEWRIGHT_PT_advanced,
    FACEWRIGHT_PT_report,
    FACEWRIGHT_PT_expressions,
    FACEWRIGHT_PT_keys,
    FACEWRIGHT_PT_controls,
    FACEWRIGHT_PT_export,
    FACEWRIGHT_PT_track,
    FACEWRIGHT_PT_track_advanced,
    FACEWRIGHT_PT_tracks,
    FACEWRIGHT_PT_motion,
    FACEWRIGHT_PT_clip_motion,
    FACEWRIGHT_PT_first_steps,
    FACEWRIGHT_PT_help,
)


def register() -> None:
    translations.register()
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.facewright_camera = bpy.props.PointerProperty(type=FacewrightCamera)
    bpy.types.Scene.facewright_rig = bpy.props.PointerProperty(type=FacewrightRig)
    bpy.types.Scene.facewright_person = bpy.props.PointerProperty(type=FacewrightPerson)
    bpy.types.Scene.facewright_clip = bpy.props.PointerProperty(type=FacewrightClip)
    bpy.types.Scene.facewright_track = bpy.props.PointerProperty(type=FacewrightTrack)
    bpy.types.Scene.facewright_motion = bpy.props.PointerProperty(type=FacewrightMotion)
    bpy.types.Scene.facewright_heads = bpy.props.PointerProperty(type=FacewrightHeads)
    bpy.types.Object.facewright_title = title()
    bpy.types.WindowManager.facewright_keys = bpy.props.PointerProperty(type=FacewrightKeys)
    bpy.types.VIEW3D_MT_mesh_add.append(draw_menu)
    bpy.types.TOPBAR_MT_file_export.append(draw_export_menu)
    bpy.types.CLIP_MT_clip.append(draw_clip_menu)
    bpy.types.CLIP_MT_clip.append(draw_track_menu)
    bpy.types.CLIP_MT_clip.append(draw_motion_menu)
    preferences.register()
    links.register()
    following.register()
    older_files.register()
    running.register()
    left_over.register()
    cli.register()


def unregister() -> None:
    stop_looking()
    cli.unregister()
    running.unregister()
    left_over.unregister()
    older_files.unregister()
    following.unregister()
    links.unregister()
    bpy.types.CLIP_MT_clip.remove(draw_motion_menu)
    bpy.types.CLIP_MT_clip.remove(draw_track_menu)
    bpy.types.CLIP_MT_clip.remove(draw_clip_menu)
    bpy.types.TOPBAR_MT_file_export.remove(draw_export_menu)
    bpy.types.VIEW3D_MT_mesh_add.remove(draw_menu)
    del bpy.types.WindowManager.facewright_keys
    del bpy.types.Object.facewright_title
    del bpy.types.Scene.facewright_heads
    del bpy.types.Scene.facewright_motion
    del bpy.types.Scene.facewright_track
    del bpy.types.Scene.facewright_clip
    del bpy.types.Scene.facewright_rig
    del bpy.types.Scene.facewright_person
    del bpy.types.Scene.facewright_camera
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    translations.unregister()
