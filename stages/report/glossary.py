"""What the figures of a report are, in a line each; definitions with their sources are in docs/movements.md."""

from __future__ import annotations

# By a measure's name without its unit, `mean_` and `sd_`.
_EXPLAINED = {
    "steps": "From one foot's landing to the other foot's; a walk has one landing more than it has steps.",
    "backward_steps": "Steps of walks in which the feet land behind each other; means are over both ways.",
    "steps_by_knees": "Steps towards the camera or away from it are hard to see; these are told by the knees' rhythm, "
                      "and are in no mean.",
    "walked": "From the first landing to the last, of all walks together.",
    "strides": "From a foot's landing to the next landing of the same foot.",
    "walks": "Walks or runs: at least three steps (two of a run) without a stop or a sharp turn.",
    "cadence": "Steps a minute, by the mean step time.",
    "walking_speed": "Distance that the pelvis moves between landings, divided by time.",
    "step_length": "From the other foot's place to this foot's, along the walk.",
    "stride_length": "From a foot's place to its next one, along the walk.",
    "step_width": "How far to the side a foot stands from the middle of the other foot's two places.",
    "step_time": "From one foot's landing to the other's.",
    "stride_time": "From a foot's landing to its next: one gait cycle.",
    "stance_time": "How long a foot is on the floor.",
    "swing_time": "How long a foot is in the air.",
    "stance": "Share of the gait cycle that the foot is on the floor.",
    "swing": "Share of the gait cycle that the foot is in the air.",
    "single_support": "Share of the gait cycle in which only this foot is on the floor.",
    "double_support": "Share of the gait cycle in which both feet are on the floor; none in a run.",
    "flight_time": "How long both feet are in the air.",
    "knee_at_contact": "Knee flexion when the foot lands.",
    "knee_loading_peak": "The highest knee flexion in the first half of stance (loading response).",
    "knee_swing_peak": "The highest knee flexion while the foot is in the air.",
    "thigh_trunk_lowest": "The thigh's lowest flexion against the trunk in a stride; negative: behind the trunk.",
    "symmetry_index": "Right minus left, divided by their mean: 0 % when equal, positive when the right is larger.",
    "stride_start": "When each stride begins: the foot lands.",
    "stride_stop": "When each stride ends: the same foot lands again, in the same walk.",
    "landings": "When the foot first touches the floor (initial contact).",
    "toe_offs": "When the foot leaves the floor.",
    "belt_speed": "Speed of the treadmill.",
    "count": "How often it was made in the whole take; a posture held for over 3 s is counted separately.",
    "squats": "Knee bends in which the less bent knee reaches 70 degrees for sure.",
    "duration": "From when the angle begins to rise until it is back at 7 % of the rise; missing if a gap hides "
                "either.",
    "rise": "By how much the angle grows in this movement alone. It may be less than the rise that counts, which is "
            "from the lowest angle before. Not given if a gap hides its start or end.",
    "longest": "For how long the posture is held; start and stop include the ways there and back.",
    "peak_mdc90": "Equal peaks of one take differ by less than this in nine of ten cases.",
    "peak_at": "When the angle is largest.",
    "peak": "The largest angle; in a knee bend that of the less bent knee.",
    "jump_height": "By how much the centre of mass rises after the feet have left the floor.",
    "height_by_flight_time": "From time in the air alone, as on a jump mat; too high if the person lands with bent "
                             "legs.",
    "contact_time": "How long the feet are on the floor before a jump that follows another within a second.",
    "take_off_feet": "On how many feet the person takes off.",
    "landing_feet": "On how many feet the person lands.",
    "path_length": "Total distance moved. Of lifted poses its error is not known; fast movements read too short.",
    "mean_speed": "Path length divided by time.",
}  # fmt: skip

# Of a walk, not of a run.
_USUAL = {
    "cadence": "Adults at ease walk 100 to 120.",
    "walking_speed": "Adults at ease walk 1.2 to 1.4 m/s.",
    "stance": "About 60 % in a walk at ease.",
}


def explained(name: str, running: bool = False, metric: bool = True) -> str:
    """A line about a measure by its name without unit, such as "mean_step_time"; empty of one that is not known. What
    is usual of a walk is not told of a run, nor that of a speed where lengths are not in metres."""
    if name.endswith("symmetry_index"):
        name = "symmetry_index"
    plain = name.removeprefix("mean_").removeprefix("sd_")
    said = _EXPLAINED.get(name) or _EXPLAINED.get(plain, "")
    usual = plain in _USUAL and not running and (metric or plain != "walking_speed")
    if said and usual and not name.startswith("sd_"):
        said = f"{said} {_USUAL[plain]}"
    return (
        f"How much the figure varies from one to the next. {said}"
        if said and name.startswith("sd_")
        else said
    )
