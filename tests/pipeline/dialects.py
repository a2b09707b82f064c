"""dialects.py write CORPUS OUT  |  dialects.py check OUT  -  one motion as many writers would put it.

`write` reads the BVH files of make-corpus (T-pose at zero rotation, facing +Z, Y up, centimetres) with a reader of its own and
writes them again on other rigs, rest poses, axes, units, channel orders and spellings, and as ASF+AMC and AMASS npz. `check` holds
the archive canonicalize makes of them against the motion itself, by a forward kinematics of its own.

A rig's joint n stands at T_n in T-pose and moves with a part of the body, G_n(t) its world rotation from T-pose. Its rest pose is
any R_n: offset_n = R_parent (T_n - T_parent), world rotation W_n(t) = G_n(t) R_n^-1.
"""
import json
import os
import sys

import numpy as np

NAMES = ("pelvis left_hip left_knee left_ankle left_foot right_hip right_knee right_ankle right_foot spine1 spine2 spine3 neck head "
         "left_collar left_shoulder left_elbow left_wrist right_collar right_shoulder right_elbow right_wrist").split()
SIDES = ("left", "right")


def axis_rotation(axis, degrees):
    a = np.radians(np.asarray(degrees, float))
    c, s, z, o = np.cos(a), np.sin(a), np.zeros_like(a), np.ones_like(a)
    rows = {"X": (o, z, z, z, c, -s, z, s, c), "Y": (c, z, s, z, o, z, -s, z, c), "Z": (c, -s, z, s, c, z, z, z, o)}[axis]
    return np.stack(rows, -1).reshape(a.shape + (3, 3))


def turn(vector, degrees):
    v = np.asarray(vector, float) / np.linalg.norm(vector)
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    a = np.radians(degrees)
    return np.eye(3) + np.sin(a) * k + (1 - np.cos(a)) * k @ k


def euler(m, order):
    """Angles of R = R_order0 R_order1 R_order2, degrees."""
    i, j, k = ("XYZ".index(c) for c in order)
    s = 1 if (j - i) % 3 == 1 else -1
    b = np.arcsin(np.clip(s * m[..., i, k], -1, 1))
    a, c = np.arctan2(-s * m[..., j, k], m[..., k, k]), np.arctan2(-s * m[..., i, j], m[..., i, i])
    return np.degrees(np.stack([a, b, c], -1))


def rotation_vectors(m):
    w = np.stack([m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]], -1)
    sine, cosine = np.linalg.norm(w, axis=-1) / 2, (np.trace(m, axis1=-2, axis2=-1) - 1) / 2
    return w * np.where(sine > 1e-9, np.arctan2(sine, cosine) / np.maximum(2 * sine, 1e-12), 0.5)[..., None]


def orthonormal(m):
    u, _, v = np.linalg.svd(m)
    return u @ v


class Motion:
    """World rotations from T-pose [T,22] and the pelvis' path, metres; left +X, up +Y, forward +Z."""

    def __init__(self, path):
        lines = open(path).read().split("\n")
        names, parents, offsets, channels, stack, self.tips = [], [], [], [], [], {}
        at = 0
        while lines[at].strip() != "MOTION":
            words = lines[at].split()
            if words[0] in ("ROOT", "JOINT"):
                parents.append(stack[-1] if stack else -1)
                stack.append(len(names))
                names.append(words[1])
            elif words[0] == "End":
                stack.append(-1)
            elif words[0] == "OFFSET":
                v = np.array(words[1:], float) / 100
                if stack[-1] < 0:
                    self.tips[names[stack[-2]]] = v
                else:
                    offsets.append(v)
            elif words[0] == "CHANNELS":
                channels.append([w[0] for w in words[2:] if w.endswith("rotation")])
            elif words[0] == "}":
                stack.pop()
            at += 1
        assert sorted(names) == sorted(NAMES), names
        self.rate = 1 / float(lines[at + 2].split()[2])
        rows = np.array([line.split() for line in lines[at + 3:] if line.strip()], float)
        self.root = rows[:, :3] / 100
        world, t_pose, column = {}, {}, 3
        for j, name in enumerate(names):
            r = np.eye(3)
            for axis in channels[j]:
                r = r @ axis_rotation(axis, rows[:, column])
                column += 1
            parent = names[parents[j]] if parents[j] >= 0 else None
            world[name] = world[parent] @ r if parent else r
            t_pose[name] = t_pose[parent] + offsets[j] if parent else np.zeros(3)
        self.G, self.T = np.stack([world[n] for n in NAMES], 1), t_pose
        self.parent = {n: names[parents[j]] if parents[j] >= 0 else None for j, n in enumerate(names)}

    def at(self, times):
        """Rotations and path at these times."""
        x = np.clip(np.asarray(times) * self.rate, 0, len(self.root) - 1)
        a = np.minimum(x.astype(int), len(self.root) - 2)
        w = (x - a)[:, None]
        return orthonormal(self.G[a] + w[..., None, None] * (self.G[a + 1] - self.G[a])), self.root[a] + w * (self.root[a + 1] - self.root[a])

    @property
    def seconds(self):
        return (len(self.root) - 1) / self.rate


def pose_of(body, G, root):
    p = {"pelvis": root}
    for n in NAMES[1:]:
        q = body.parent[n]
        p[n] = p[q] + G[:, NAMES.index(q)] @ (body.T[n] - body.T[q])
    return p


# ---- rigs. Chains are 'Name' or 'Name=part'; {S} Left/Right, {L} L/R, {l} l/r, {s} left/right. A '+' in front: a leaf beside the chain.
def rig(centre, leg, arm, **more):
    return dict(centre=centre.split("|"), leg=leg.split("|"), arm=arm.split("|"), **more)


STANDARD_LEG = "hip|knee|ankle|foot"
FINGERS = ("Thumb", "Index", "Middle", "Ring", "Pinky")


def fingers(template, joints=3):
    return [template.format(f=f, n=n, S="{S}", L="{L}", l="{l}", s="{s}") for f in FINGERS for n in range(1, joints + 1)]


RIGS = {
    "mixamo": rig("mixamorig:Hips=pelvis|mixamorig:Spine=s.2|mixamorig:Spine1=s.45|mixamorig:Spine2=s.7|mixamorig:Neck=neck|mixamorig:Head=head|mixamorig:HeadTop_End=headtip",
                  "mixamorig:{S}UpLeg=hip|mixamorig:{S}Leg=knee|mixamorig:{S}Foot=ankle|mixamorig:{S}ToeBase=foot|mixamorig:{S}Toe_End=toetip",
                  "mixamorig:{S}Shoulder=collar|mixamorig:{S}Arm=shoulder|mixamorig:{S}ForeArm=elbow|mixamorig:{S}Hand=wrist", fingers=fingers("mixamorig:{S}Hand{f}{n}", 4)),
    "humanik": rig("Reference=ground|Hips=pelvis|Spine=s.15|Spine1=s.4|Spine2=s.6|Spine3=s.8|Neck=neck|Neck1=neck.5|Head=head",
                   "{S}UpLeg=hip|{S}UpLegRoll=hip.5+|{S}Leg=knee|{S}LegRoll=knee.5+|{S}Foot=ankle|{S}ToeBase=foot|{S}ToeBaseEnd=toetip",
                   "{S}Shoulder=collar|{S}Arm=shoulder|{S}ArmRoll=shoulder.5+|{S}ForeArm=elbow|{S}ForeArmRoll=elbow.5+|{S}Hand=wrist", fingers=fingers("{S}Hand{f}{n}")),
    "character1": rig("Character1_Reference=ground|Character1_Hips=pelvis|Character1_Spine=s.3|Character1_Spine1=s.7|Character1_Neck=neck|Character1_Head=head",
                      "Character1_{S}UpLeg=hip|Character1_{S}Leg=knee|Character1_{S}Foot=ankle|Character1_{S}ToeBase=foot",
                      "Character1_{S}Shoulder=collar|Character1_{S}Arm=shoulder|Character1_{S}ForeArm=elbow|Character1_{S}Hand=wrist"),
    "rokoko": rig("Hips=pelvis|Spine1=s.15|Spine2=s.3|Spine3=s.5|Spine4=s.75|Neck=neck|Head=head", "{S}Thigh=hip|{S}Shin=knee|{S}Foot=ankle|{S}Toe=foot|{S}ToeTip=toetip",
                  "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist", fingers=fingers("{S}Finger{f}{n}")),
    "lafan1": rig("Hips=pelvis|Spine=s.2|Spine1=s.4|Spine2=s.6|Neck=neck|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}Toe=foot", "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist"),
    "xsens": rig("Hips=pelvis|Chest=s.2|Chest2=s.4|Chest3=s.55|Chest4=s.75|Neck=neck|Head=head", "{S}Hip=hip|{S}Knee=knee|{S}Ankle=ankle|{S}Toe=foot", "{S}Collar=collar|{S}Shoulder=shoulder|{S}Elbow=elbow|{S}Wrist=wrist"),
    "xsens-mvn": rig("Pelvis=pelvis|L5=s.1|L3=s.3|T12=s.5|T8=s.75|Neck=neck|Head=head", "{S}UpperLeg=hip|{S}LowerLeg=knee|{S}Foot=ankle|{S}Toe=foot", "{S}Shoulder=collar|{S}UpperArm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist"),
    "motive": rig("Skeleton_Hip=pelvis|Skeleton_Ab=s.25|Skeleton_Chest=s.6|Skeleton_Neck=neck|Skeleton_Head=head", "Skeleton_{L}Thigh=hip|Skeleton_{L}Shin=knee|Skeleton_{L}Foot=ankle|Skeleton_{L}Toe=foot",
                  "Skeleton_{L}Shoulder=collar|Skeleton_{L}UArm=shoulder|Skeleton_{L}FArm=elbow|Skeleton_{L}Hand=wrist"),
    "biped": rig("Bip01=pelvis|Bip01 Pelvis=pelvis|Bip01 Spine=s.1|Bip01 Spine1=s.4|Bip01 Spine2=s.7|Bip01 Neck=neck|Bip01 Head=head|Bip01 HeadNub=headtip",
                 "Bip01 {L} Thigh=hip|Bip01 {L} Calf=knee|Bip01 {L} Foot=ankle|Bip01 {L} Toe0=foot|Bip01 {L} Toe0Nub=toetip",
                 "Bip01 {L} Clavicle=collar|Bip01 {L} UpperArm=shoulder|Bip01 {L} Forearm=elbow|Bip01 {L} Hand=wrist", arms_from="Bip01 Neck", fingers=["Bip01 {L} Finger%d" % k for k in range(5)] + ["Bip01 {L} Finger%d1" % k for k in range(5)]),
    "unreal": rig("root=ground|pelvis=pelvis|spine_01=s.2|spine_02=s.45|spine_03=s.7|neck_01=neck|head=head",
                  "thigh_{l}=hip|thigh_twist_01_{l}=hip.5+|calf_{l}=knee|calf_twist_01_{l}=knee.5+|foot_{l}=ankle|ball_{l}=foot",
                  "clavicle_{l}=collar|upperarm_{l}=shoulder|upperarm_twist_01_{l}=shoulder.5+|lowerarm_{l}=elbow|lowerarm_twist_01_{l}=elbow.5+|hand_{l}=wrist", fingers=[f"{f}_0{n}_{{l}}" for f in ("thumb", "index", "middle", "ring", "pinky") for n in (1, 2, 3)],
                  extra=["ik_foot_root=ground", "ik_foot_l=ground", "ik_foot_r=ground", "ik_hand_root=ground", "ik_hand_gun=ground", "ik_hand_l=ground", "ik_hand_r=ground"]),
    "kinect": rig("SpineBase=pelvis|SpineMid=s.4|SpineShoulder=s.9|Neck=neck|Head=head", "Hip{S}=hip|Knee{S}=knee|Ankle{S}=ankle|Foot{S}=foot", "Shoulder{S}=shoulder|Elbow{S}=elbow|Wrist{S}=wrist|Hand{S}=handmid|HandTip{S}=handtip", arms_from="SpineShoulder"),
    "kinect-azure": rig("PELVIS=pelvis|SPINE_NAVEL=s.35|SPINE_CHEST=s.7|NECK=neck|HEAD=head", "HIP_{SS}=hip|KNEE_{SS}=knee|ANKLE_{SS}=ankle|FOOT_{SS}=foot", "CLAVICLE_{SS}=collar|SHOULDER_{SS}=shoulder|ELBOW_{SS}=elbow|WRIST_{SS}=wrist|HAND_{SS}=handmid"),
    "metarig": rig("spine=pelvis|spine.001=s.2|spine.002=s.45|spine.003=s.7|spine.004=neck|spine.005=neck.5|spine.006=head",
                   "thigh.{L}=hip|shin.{L}=knee|foot.{L}=ankle|toe.{L}=foot", "shoulder.{L}=collar|upper_arm.{L}=shoulder|forearm.{L}=elbow|hand.{L}=wrist", arms_from="spine.003",
                   fingers=["palm.0%d.{L}" % n for n in (1, 2, 3, 4)] + ["f_%s.0%d.{L}" % (f, n) for f in ("index", "middle", "ring", "pinky") for n in (1, 2, 3)], leaves=["heel.02.{L}=heel", "pelvis.{L}=pelvisside", "breast.{L}=breast"]),
    "rigify-def": rig("root=ground|DEF-spine=pelvis|DEF-spine.001=s.2|DEF-spine.002=s.45|DEF-spine.003=s.7|DEF-spine.004=neck|DEF-spine.005=neck.5|DEF-spine.006=head",
                      "DEF-thigh.{L}=hip|DEF-thigh.{L}.001=hip.5|DEF-shin.{L}=knee|DEF-shin.{L}.001=knee.5|DEF-foot.{L}=ankle|DEF-toe.{L}=foot",
                      "DEF-shoulder.{L}=collar|DEF-upper_arm.{L}=shoulder|DEF-upper_arm.{L}.001=shoulder.5|DEF-forearm.{L}=elbow|DEF-forearm.{L}.001=elbow.5|DEF-hand.{L}=wrist", arms_from="DEF-spine.003"),
    "vrm": rig("Root=ground|J_Bip_C_Hips=pelvis|J_Bip_C_Spine=s.2|J_Bip_C_Chest=s.45|J_Bip_C_UpperChest=s.7|J_Bip_C_Neck=neck|J_Bip_C_Head=head",
               "J_Bip_{L}_UpperLeg=hip|J_Bip_{L}_LowerLeg=knee|J_Bip_{L}_Foot=ankle|J_Bip_{L}_ToeBase=foot", "J_Bip_{L}_Shoulder=collar|J_Bip_{L}_UpperArm=shoulder|J_Bip_{L}_LowerArm=elbow|J_Bip_{L}_Hand=wrist",
               fingers=["J_Bip_{L}_%s%d" % (f, n) for f in ("Thumb", "Index", "Middle", "Ring", "Little") for n in (1, 2, 3)], extra=["J_Adj_L_FaceEye=head", "J_Adj_R_FaceEye=head", "J_Sec_Hair1_01=head", "J_Sec_Hair2_01=head", "J_Sec_L_Bust1=s.7", "J_Sec_R_Bust1=s.7"]),
    "vrm-humanoid": rig("hips=pelvis|spine=s.2|chest=s.45|upperChest=s.7|neck=neck|head=head", "{s}UpperLeg=hip|{s}LowerLeg=knee|{s}Foot=ankle|{s}Toes=foot", "{s}Shoulder=collar|{s}UpperArm=shoulder|{s}LowerArm=elbow|{s}Hand=wrist", extra=["leftEye=head", "rightEye=head", "jaw=head"]),
    "neuron": rig("Hips=pelvis|Spine=s.15|Spine1=s.35|Spine2=s.55|Spine3=s.8|Neck=neck|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle",
                  "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist", fingers=["{S}HandThumb1", "{S}HandThumb2", "{S}HandThumb3", "{S}InHandIndex", "{S}HandIndex1", "{S}HandIndex2", "{S}InHandMiddle", "{S}HandMiddle1", "{S}InHandRing", "{S}HandRing1", "{S}InHandPinky", "{S}HandPinky1"]),
    "poser": rig("hip=pelvis|abdomen=s.2|chest=s.55|neck=neck|head=head", "{l}Buttock=buttock|{l}Thigh=hip|{l}Shin=knee|{l}Foot=ankle|{l}Toe=foot", "{l}Collar=collar|{l}Shldr=shoulder|{l}ForeArm=elbow|{l}Hand=wrist",
                 fingers=["{l}Thumb1", "{l}Thumb2", "{l}Index1", "{l}Index2", "{l}Mid1", "{l}Mid2", "{l}Ring1", "{l}Pinky1"], extra=["leftEye=head", "rightEye=head"]),
    "daz-g8": rig("hip=pelvis|pelvis=pelvis|", "{l}ThighBend=hip|{l}ThighTwist=hip.5|{l}Shin=knee|{l}Foot=ankle|{l}Metatarsals=foot.-.4|{l}Toe=foot",
                  "{l}Collar=collar|{l}ShldrBend=shoulder|{l}ShldrTwist=shoulder.5|{l}ForearmBend=elbow|{l}ForearmTwist=elbow.5|{l}Hand=wrist",
                  spine_of="hip", spine="abdomenLower=s.2|abdomenUpper=s.4|chestLower=s.55|chestUpper=s.75|neckLower=neck|neckUpper=neck.5|head=head", fingers=["{l}Carpal1", "{l}Index1", "{l}Index2", "{l}Thumb1", "{l}Thumb2"]),
    "daz-g9": rig("hip=pelvis|pelvis=pelvis|", "{l}_thigh=hip|{l}_shin=knee|{l}_foot=ankle|{l}_metatarsal=foot.-.4|{l}_toes=foot", "{l}_shoulder=collar|{l}_upperarm=shoulder|{l}_forearm=elbow|{l}_hand=wrist",
                  spine_of="hip", spine="spine1=s.2|spine2=s.4|spine3=s.55|spine4=s.75|neck1=neck|neck2=neck.5|head=head", fingers=["{l}_thumb1", "{l}_index1", "{l}_mid1", "{l}_ring1", "{l}_pinky1", "{l}_bigtoe1=toe", "{l}_indextoe1=toe", "{l}_midtoe1=toe"]),
    "sfu": rig("Hips=pelvis|LowerBack=s.05|Spine=s.3|Spine1=s.6|Neck=neck|Neck1=neck.5|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}ToeBase=foot", "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist", leaves=["{S}FingerBase=handmid", "{S}HandIndex1=handmid", "{L}Thumb=wrist"]),
    "cgspeed": rig("Hips=pelvis|LowerBack=s.05|Spine=s.3|Spine1=s.6|Neck=neck|Neck1=neck.5|Head=head", "{L}HipJoint=pelvis|{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}ToeBase=foot",
                   "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist|{S}FingerBase=handmid|{S}HandIndex1=handtip"),
    "100style": rig("Hips=pelvis|Chest=s.15|Chest2=s.35|Chest3=s.55|Chest4=s.75|Neck=neck|Head=head", "{S}Hip=hip|{S}Knee=knee|{S}Ankle=ankle|{S}Toe=foot", "{S}Collar=collar|{S}Shoulder=shoulder|{S}Elbow=elbow|{S}Wrist=wrist"),
    "hdm05": rig("root=pelvis|lowerback=s.05|upperback=s.3|thorax=s.6|lowerneck=neck|upperneck=neck.5|head=head", "{l}hipjoint=pelvis|{l}femur=hip|{l}tibia=knee|{l}foot=ankle|{l}toes=foot",
                 "{l}clavicle=collar|{l}humerus=shoulder|{l}radius=elbow|{l}wrist=wrist|{l}hand=handmid|{l}fingers=handtip", leaves=["{l}thumb=wrist"]),
    "truebones": rig("BVH:reference=ground|BVH:Hips=pelvis|BVH:Spine=s.3|BVH:Spine1=s.6|BVH:Neck=neck|BVH:Head=head", "BVH:{S}UpLeg=hip|BVH:{S}Leg=knee|BVH:{S}Foot=ankle|BVH:{S}ToeBase=foot",
                     "BVH:{S}Shoulder=collar|BVH:{S}Arm=shoulder|BVH:{S}ForeArm=elbow|BVH:{S}Hand=wrist"),
    "max-prefix": rig("jt_Root_01=pelvis|jt_Spine_C0_01=s.2|jt_SpineChest_C0_01=s.6|jt_Neck_C0_01=neck|jt_Head_C0_01=head", "jt_Leg_Upper_{L}0_01=hip|jt_Leg_Lower_{L}0_01=knee|jt_Foot_{L}0_01=ankle|jt_Toe_{L}0_01=foot",
                      "jt_Clavicle_{L}0_01=collar|jt_Arm_Upper_{L}0_01=shoulder|jt_Arm_Lower_{L}0_01=elbow|jt_Hand_{L}0_01=wrist"),
    "smpl": rig("Pelvis=pelvis|Spine1=spine1|Spine2=spine2|Spine3=spine3|Neck=neck|Head=head", "{L}_Hip=hip|{L}_Knee=knee|{L}_Ankle=ankle|{L}_Foot=foot", "{L}_Collar=collar|{L}_Shoulder=shoulder|{L}_Elbow=elbow|{L}_Wrist=wrist|{L}_Hand=handmid", arms_from="Spine3"),
    "smpl-maya": rig("m_avg_root=ground|m_avg_Pelvis=pelvis|m_avg_Spine1=spine1|m_avg_Spine2=spine2|m_avg_Spine3=spine3|m_avg_Neck=neck|m_avg_Head=head", "m_avg_{L}_Hip=hip|m_avg_{L}_Knee=knee|m_avg_{L}_Ankle=ankle|m_avg_{L}_Foot=foot",
                     "m_avg_{L}_Collar=collar|m_avg_{L}_Shoulder=shoulder|m_avg_{L}_Elbow=elbow|m_avg_{L}_Wrist=wrist|m_avg_{L}_Hand=handmid", arms_from="m_avg_Spine3"),
    "makehuman": rig("root=pelvis|spine05=s.1|spine04=s.25|spine03=s.4|spine02=s.6|spine01=s.8|neck01=neck|neck02=neck.3|neck03=neck.6|head=head", "pelvis.{L}=pelvis|upperleg01.{L}=hip|upperleg02.{L}=hip.5|lowerleg01.{L}=knee|lowerleg02.{L}=knee.5|foot.{L}=ankle|toe1-1.{L}=foot",
                     "clavicle.{L}=collar|shoulder01.{L}=collar.9|upperarm01.{L}=shoulder|upperarm02.{L}=shoulder.5|lowerarm01.{L}=elbow|lowerarm02.{L}=elbow.5|wrist.{L}=wrist", arms_from="spine01", fingers=["finger%d-1.{L}" % n for n in range(1, 6)], extra=["jaw=head", "eye.L=head", "eye.R=head", "tongue00=head"]),
    "bandai": rig("joint_Root=ground|Hips=pelvis|Spine=s.3|Chest=s.65|Neck=neck|Head=head", "UpperLeg_{L}=hip|LowerLeg_{L}=knee|Foot_{L}=ankle|Toes_{L}=foot", "Shoulder_{L}=collar|UpperArm_{L}=shoulder|LowerArm_{L}=elbow|Hand_{L}=wrist"),
    "biovision": rig("Hips=pelvis|Chest=s.3|Neck=neck|Head=head", "{S}Hip=hip|{S}Knee=knee|{S}Ankle=ankle", "{S}Collar=collar|{S}Shoulder=shoulder|{S}Elbow=elbow|{S}Wrist=wrist"),
    "biovision-2": rig("ToSpine=pelvis|Hips=pelvis|", "{S}UpLeg=hip|{S}LowLeg=knee|{S}Foot=ankle", "{S}Collar=collar|{S}UpArm=shoulder|{S}LowArm=elbow|{S}Hand=wrist", spine_of="ToSpine", spine="Chest=s.3|Neck=neck|Head=head", arms_from="Chest"),
    "eyes-japan": rig("hip=pelvis|abdomen=s.2|chest=s.5|neck=neck|head=head", "{l}Thigh=hip|{l}Shin=knee|{l}Foot=ankle", "{l}Collar=collar|{l}Shldr=shoulder|{l}ForeArm=elbow|{l}Hand=wrist"),
    "advanced-skeleton": rig("Root_M=pelvis|Spine1_M=s.3|Chest_M=s.65|Neck_M=neck|Head_M=head", "Hip_{L}=hip|HipPart1_{L}=hip.5+|Knee_{L}=knee|Ankle_{L}=ankle|Toes_{L}=foot|ToesEnd_{L}=toetip", "Scapula_{L}=collar|Shoulder_{L}=shoulder|ShoulderPart1_{L}=shoulder.5+|Elbow_{L}=elbow|Wrist_{L}=wrist",
                             fingers=["MiddleFinger1_{L}", "ThumbFinger1_{L}", "Cup_{L}"], arms_from="Chest_M"),
    "character-creator": rig("CC_Base_BoneRoot=ground|CC_Base_Hip=pelvis|", "CC_Base_{L}_Thigh=hip|CC_Base_{L}_ThighTwist01=hip.3+|CC_Base_{L}_Calf=knee|CC_Base_{L}_CalfTwist01=knee.3+|CC_Base_{L}_Foot=ankle|CC_Base_{L}_ToeBase=foot",
                             "CC_Base_{L}_Clavicle=collar|CC_Base_{L}_Upperarm=shoulder|CC_Base_{L}_UpperarmTwist01=shoulder.3+|CC_Base_{L}_Forearm=elbow|CC_Base_{L}_ForearmTwist01=elbow.3+|CC_Base_{L}_Hand=wrist", middle="CC_Base_Pelvis=pelvis",
                             spine_of="CC_Base_Hip", spine="CC_Base_Waist=s.2|CC_Base_Spine01=s.4|CC_Base_Spine02=s.7|CC_Base_NeckTwist01=neck|CC_Base_NeckTwist02=neck.5|CC_Base_Head=head", arms_from="CC_Base_Spine02", fingers=["CC_Base_{L}_Index1", "CC_Base_{L}_Mid1"], extra=["CC_Base_FacialBone=head", "CC_Base_JawRoot=head", "CC_Base_L_Eye=head", "CC_Base_R_Eye=head"]),
    "mvn-segments": rig("Segment_Pelvis=pelvis|Segment_Spine=s.3|Segment_Chest=s.6|Segment_Neck=neck|Segment_Head=head", "Segment_{S}_Hip=hip|Segment_{S}_Knee=knee|Segment_{S}_Ankle=ankle|Segment_{S}_Toe=foot", "Segment_{S}_Clavicle=collar|Segment_{S}_Shoulder=shoulder|Segment_{S}_Elbow=elbow|Segment_{S}_Wrist=wrist"),
    "japanese": rig("センター=pelvis|下半身=pelvis|", "{J}足=hip|{J}ひざ=knee|{J}足首=ankle|{J}つま先=foot", "{J}肩=collar|{J}腕=shoulder|{J}ひじ=elbow|{J}手首=wrist", spine_of="センター", spine="上半身=s.3|上半身2=s.6|首=neck|頭=head"),
    "spaced": rig("my hips.1=pelvis|my spine - a=s.4|my neck=neck|my head=head", "{s} upper-leg=hip|{s} lower-leg=knee|{s} foot.x=ankle|{s} toe 1=foot", "{s} shoulder=collar|{s} upper-arm=shoulder|{s} fore-arm=elbow|{s} hand=wrist"),
    "no-clavicle": rig("Hips=pelvis|Spine=s.4|Neck=neck|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}Toe=foot", "{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist"),
    "no-neck": rig("Hips=pelvis|Spine=s.3|Spine1=s.6|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}ToeBase=foot", "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist", arms_from="Spine1"),
    "no-head": rig("Hips=pelvis|Spine=s.3|Spine1=s.6", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}ToeBase=foot", "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow", arms_from="Spine1"),
    "no-toes-hands": rig("Hips=pelvis|Spine=s.4|Neck=neck|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle", "{S}Arm=shoulder|{S}ForeArm=elbow", arms_from="Spine"),
    "no-spine": rig("Hips=pelvis|Neck=neck|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}Toe=foot", "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist", arms_from="Hips"),
    "eight-spines": rig("Hips=pelvis|" + "|".join("Spine%d=s.%02d" % (k, 8 + 11 * k) for k in range(8)) + "|Neck=neck|Head=head", "{S}UpLeg=hip|{S}Leg=knee|{S}Foot=ankle|{S}Toe=foot", "{S}Shoulder=collar|{S}Arm=shoulder|{S}ForeArm=elbow|{S}Hand=wrist"),
    "props": rig("World=ground|Armature=ground|Hips=pelvis|Spine=s.3|Chest=s.6|Neck=neck|Head=head", "Leg_Upper_{S}=hip|Leg_Lower_{S}=knee|Foot_{S}=ankle|Toe_{S}=foot", "Clavicle_{S}=collar|Arm_Upper_{S}=shoulder|Arm_Lower_{S}=elbow|Hand_{S}=wrist",
                 extra=["Prop_Sword=handR", "Camera=ground", "Tail1=pelvis", "Skirt_L1=pelvis", "Skirt_R1=pelvis", "Weapon_Back=s.6"]),
}
for _name, _centre, _leg, _arm in (  # names alone
    ("vrchat", "Armature=ground|Hips=pelvis|Spine=s.3|Chest=s.6|Neck=neck|Head=head", "{S} leg=hip|{S} knee=knee|{S} ankle=ankle|{S} toe=foot", "{S} shoulder=collar|{S} arm=shoulder|{S} elbow=elbow|{S} wrist=wrist"),
    ("second-life", "mPelvis=pelvis|mTorso=s.3|mChest=s.6|mNeck=neck|mHead=head", "mHip{S}=hip|mKnee{S}=knee|mAnkle{S}=ankle|mFoot{S}=foot|mToe{S}=toetip", "mCollar{S}=collar|mShoulder{S}=shoulder|mElbow{S}=elbow|mWrist{S}=wrist"),
    ("valve", "ValveBiped.Bip01=pelvis|ValveBiped.Bip01_Pelvis=pelvis|ValveBiped.Bip01_Spine=s.2|ValveBiped.Bip01_Spine2=s.6|ValveBiped.Bip01_Neck1=neck|ValveBiped.Bip01_Head1=head", "ValveBiped.Bip01_{L}_Thigh=hip|ValveBiped.Bip01_{L}_Calf=knee|ValveBiped.Bip01_{L}_Foot=ankle|ValveBiped.Bip01_{L}_Toe0=foot", "ValveBiped.Bip01_{L}_Clavicle=collar|ValveBiped.Bip01_{L}_UpperArm=shoulder|ValveBiped.Bip01_{L}_Forearm=elbow|ValveBiped.Bip01_{L}_Hand=wrist"),
    ("arkit", "root=ground|hips_joint=pelvis|spine_1_joint=s.2|spine_2_joint=s.4|spine_3_joint=s.6|neck_1_joint=neck|neck_2_joint=neck.5|head_joint=head", "{s}_upLeg_joint=hip|{s}_leg_joint=knee|{s}_foot_joint=ankle|{s}_toes_joint=foot", "{s}_shoulder_1_joint=collar|{s}_arm_joint=shoulder|{s}_forearm_joint=elbow|{s}_hand_joint=wrist"),
    ("deepmotion", "root=ground|hips_JNT=pelvis|spine_JNT=s.2|spine1_JNT=s.5|spine2_JNT=s.7|neck_JNT=neck|head_JNT=head", "{l}_upleg_JNT=hip|{l}_leg_JNT=knee|{l}_foot_JNT=ankle|{l}_toebase_JNT=foot", "{l}_shoulder_JNT=collar|{l}_arm_JNT=shoulder|{l}_forearm_JNT=elbow|{l}_hand_JNT=wrist"),
    ("cascadeur", "pelvis=pelvis|stomach=s.3|chest=s.6|neck=neck|head=head", "thigh_{l}=hip|calf_{l}=knee|foot_{l}=ankle|toe_{l}=foot", "clavicle_{l}=collar|arm_{l}=shoulder|forearm_{l}=elbow|hand_{l}=wrist"),
    ("roblox", "HumanoidRootNode=ground|LowerTorso=pelvis|UpperTorso=s.4|Head=head", "{S}UpperLeg=hip|{S}LowerLeg=knee|{S}Foot=ankle", "{S}UpperArm=shoulder|{S}LowerArm=elbow|{S}Hand=wrist"),
    ("pose-estimator", "Hip=pelvis|Spine=s.4|Thorax=s.9|Neck=neck|HeadTop=head", "{S}Hip=hip|{S}Knee=knee|{S}Ankle=ankle", "{S}Shoulder=shoulder|{S}Elbow=elbow|{S}Wrist=wrist"),
    ("theia", "worldbody=ground|pelvis=pelvis|abdomen=s.3|thorax=s.6|neck=neck|head=head", "{l}_thigh=hip|{l}_shank=knee|{l}_foot=ankle|{l}_toes=foot", "{l}_upperarm=shoulder|{l}_lowerarm=elbow|{l}_hand=wrist"),
    ("opensim", "ground=ground|pelvis=pelvis|torso=s.3|head=head", "femur_{l}=hip|tibia_{l}=knee|talus_{l}=ankle|calcn_{l}=heel+|toes_{l}=foot", "humerus_{l}=shoulder|ulna_{l}=elbow|radius_{l}=elbow|hand_{l}=wrist"),
    ("upper-case", "HIPS=pelvis|SPINE=s.4|NECK=neck|HEAD=head", "{SS}_THIGH=hip|{SS}_SHIN=knee|{SS}_FOOT=ankle|{SS}_TOE=foot", "{SS}_COLLAR=collar|{SS}_UPPERARM=shoulder|{SS}_FOREARM=elbow|{SS}_HAND=wrist"),
    ("run-together", "root=pelvis|lowerspine=s.3|upperspine=s.6|neck=neck|head=head", "{s}upperleg=hip|{s}lowerleg=knee|{s}foot=ankle|{s}toe=foot", "{s}clavicle=collar|{s}upperarm=shoulder|{s}lowerarm=elbow|{s}hand=wrist"),
    ("sided-behind", "Hip=pelvis|Spine01=s.4|Neck=neck|Head=head", "UpLeg{S}=hip|LowLeg{S}=knee|Foot{S}=ankle|Toe{S}=foot", "Collar{S}=collar|UpArm{S}=shoulder|LowArm{S}=elbow|Hand{S}=wrist"),
    ("suffixed", "Hips_end0=pelvis|Spine_jnt=s.4|Neck_jnt=neck|Head_jnt=head", "L_UpperLeg_{L}=hip".replace("L_UpperLeg_{L}", "UpperLeg_{l}_jnt") + "|LowerLeg_{l}_jnt=knee|Foot_{l}_jnt=ankle|Toe_{l}_jnt=foot", "Clavicle_{l}_jnt=collar|UpperArm_{l}_jnt=shoulder|LowerArm_{l}_jnt=elbow|Hand_{l}_jnt=wrist"),
    ("momentum", "body_world=ground|root=pelvis|c_spine0=s.1|c_spine1=s.3|c_spine2=s.5|c_spine3=s.7|c_neck=neck|c_head=head", "{l}_upleg=hip|{l}_lowleg=knee|{l}_foot=ankle|{l}_ball=foot", "{l}_clavicle=collar|{l}_uparm=shoulder|{l}_lowarm=elbow|{l}_wrist=wrist"),
    ("metahuman", "root=ground|pelvis=pelvis|spine_01=s.1|spine_02=s.25|spine_03=s.4|spine_04=s.6|spine_05=s.8|neck_01=neck|neck_02=neck.5|head=head", "thigh_{l}=hip|thigh_correctiveRoot_{l}=hip+|calf_{l}=knee|foot_{l}=ankle|ball_{l}=foot", "clavicle_{l}=collar|clavicle_out_{l}=collar+|upperarm_{l}=shoulder|upperarm_correctiveRoot_{l}=shoulder+|lowerarm_{l}=elbow|hand_{l}=wrist"),
    ("hub", "Hips=pelvis|Chest=s.4|Neck=neck|Head=head", "{S}Hip=pelvis|{S}Thigh=hip|{S}Knee=knee|{S}Foot=ankle|{S}Toe=foot", "{S}Collar=collar|{S}Shoulder=shoulder|{S}Elbow=elbow|{S}Hand=wrist"),
    ("robot", "Robot_Hips=pelvis|Robot_Spine=s.3|Robot_Spine1=s.6|Robot_Neck=neck|Robot_Head=head", "Robot_{S}UpLeg=hip|Robot_{S}Leg=knee|Robot_{S}Foot=ankle", "Robot_{S}Shoulder=collar|Robot_{S}Arm=shoulder|Robot_{S}ForeArm=elbow|Robot_{S}Hand=wrist"),
):
    RIGS[_name] = rig(_centre, _leg, _arm)

BEASTS = {
    "quadruped": rig("Pelvis=pelvis|Spine=s.4|Neck=neck|Head=head", "BackLeg{S}Upper=hip|BackLeg{S}Lower=knee|BackLeg{S}Paw=ankle", "FrontLeg{S}Upper=shoulder|FrontLeg{S}Lower=elbow|FrontLeg{S}Paw=wrist", extra=["Tail1=pelvis", "Tail2=pelvis"]),
    "hand": rig("hand_R=pelvis|palm=s.5", "thumb1_{L}=hip|thumb2_{L}=knee|thumb3_{L}=ankle", "index1_{L}=shoulder|index2_{L}=elbow|index3_{L}=wrist"),
    "numbered": rig("Bone01=pelvis|Bone02=s.5|Bone03=neck", "Bone1{L}=hip|Bone2{L}=knee|Bone3{L}=ankle", "Bone4{L}=shoulder|Bone5{L}=elbow|Bone6{L}=wrist"),
}


class Rig:
    """names, parents, T [J,3], and what drives each joint: (part, next part, weight)."""

    def __init__(self, spec, body, rng):
        self.names, self.parents, self.T, self.drive = [], [], [], []
        self.body, tips = body, body.tips
        ground = np.array([0, -body.floor, 0])
        spine = ["pelvis", "spine1", "spine2", "spine3", "neck"]
        heights = np.array([body.T[n][1] for n in spine])

        def place(part, side):
            p = f"{side}_"
            if part == "ground":
                return ground, None
            if part.startswith("s."):
                f = float("0" + part[1:])
                y = heights[0] + f * (heights[-1] - heights[0])
                k = int(np.searchsorted(heights, y, side="right")) - 1
                w = (y - heights[k]) / (heights[k + 1] - heights[k])
                return np.array([0, y, 0]), (spine[k], spine[min(k + 1, 3)], w)
            base, _, fraction = part.partition(".")
            sided = p + base if p + base in body.T else base
            if fraction:
                f = float("0." + fraction) if not fraction.startswith("-") else -float("0" + fraction[1:])
                if f < 0:  # back towards the parent, and moving with it
                    q = body.parent[sided]
                    return body.T[sided] + f * (body.T[sided] - body.T[q]), (q, q, 0)
                child = next(n for n in NAMES if body.parent[n] == sided)
                return body.T[sided] + f * (body.T[child] - body.T[sided]), (sided, sided, 0)
            special = {"headtip": ("head", tips["head"]), "toetip": (p + "foot", tips[p + "foot"]), "toe": (p + "foot", 0.5 * tips[p + "foot"] + [0.02 * (side == "left") - 0.01, 0, 0]), "handmid": (p + "wrist", 0.4 * tips[p + "wrist"]),
                       "handtip": (p + "wrist", 0.9 * tips[p + "wrist"]), "heel": (p + "ankle", np.array([0, -0.04, -0.05])), "breast": ("spine3", body.T[p + "hip"] * [1, 0, 0] + [0, 0.05, 0.1]),
                       "pelvisside": ("pelvis", body.T[p + "hip"] * 0.3), "buttock": ("pelvis", body.T[p + "hip"] * 0.5), "handR": ("right_wrist", 0.4 * tips["right_wrist"])}
            if part in special:
                q, v = special[part]
                return body.T[q] + v, (q, q, 0)
            return body.T[sided], (sided, sided, 0)

        def add(entry, parent, side="left", leaf=None):
            name, _, part = entry.partition("=")
            k = side == "left"
            name = name.format(S="Left" if k else "Right", L="L" if k else "R", l="l" if k else "r", s=side, SS=side.upper(), J="左" if k else "右")
            position, drive = place(part or leaf, side)
            if leaf and not part:
                position = position + rng.normal(0, 0.02, 3)
            self.names.append(name)
            self.parents.append(parent)
            self.T.append(position)
            self.drive.append(drive)
            return len(self.names) - 1

        def chain(entries, parent, side="left"):
            for e in entries:
                if not e:
                    continue
                if e.endswith("+"):
                    add(e[:-1], parent, side)
                else:
                    parent = add(e, parent, side)
            return parent

        end = chain(spec["centre"], -1)
        find = lambda name: self.names.index(name)
        pelvis = next((j for j in reversed(range(len(self.names))) if self.drive[j] and self.drive[j][0] == "pelvis" and self.T[j] @ self.T[j] < 1e-12), 0)
        if "middle" in spec:
            pelvis = chain([spec["middle"]], pelvis)
        if "spine" in spec:
            end = chain(spec["spine"].split("|"), find(spec["spine_of"]))
        chest = find(spec["arms_from"]) if "arms_from" in spec else max((j for j in range(len(self.names)) if self.names[j] and self.drive[j] and self.drive[j][0].startswith("spine")), default=pelvis)
        for side in SIDES:
            chain(spec["leg"], pelvis, side)
            tip = chain(spec["arm"], chest, side)
            wrist = next((j for j in reversed(range(len(self.names))) if self.drive[j] and self.drive[j][0] == side + "_wrist"), tip)
            previous = None
            for f in spec.get("fingers", []):
                if f.endswith("=toe"):
                    add(f, next(j for j in range(len(self.names)) if self.drive[j] == (side + "_foot", side + "_foot", 0)), side)
                    continue
                digits = "".join(c for c in f if c.isdigit())
                on = previous if previous is not None and digits and not digits.endswith("1") and not digits.endswith("0") else wrist
                previous = add(f, on, side, "handmid")
            for f in spec.get("leaves", []):
                part = f.partition("=")[2]
                base = {"heel": side + "_ankle", "pelvisside": "pelvis", "breast": "spine3"}.get(part, side + "_wrist")
                on = next((j for j in reversed(range(len(self.names))) if self.drive[j] and self.drive[j][0] == base), pelvis)
                add(f, on, side)
        for e in spec.get("extra", []):
            part = e.partition("=")[2]
            base = {"ground": None, "handR": "right_wrist"}.get(part, part)
            on = 0 if base is None else chest if base.startswith("s.") else next(j for j in range(len(self.names)) if self.drive[j] and self.drive[j][0] == base)
            add(e, on)
        # A BVH is written depth first.
        order, children = [], {}
        for j, p in enumerate(self.parents):
            children.setdefault(p, []).append(j)

        def visit(j):
            order.append(j)
            for k in children.get(j, []):
                visit(k)
        visit(0)
        rank = {j: k for k, j in enumerate(order)}
        self.names, self.drive = [self.names[j] for j in order], [self.drive[j] for j in order]
        self.parents, self.T = [rank.get(self.parents[j], -1) for j in order], np.array([self.T[j] for j in order])
        for j, p in enumerate(self.parents):  # nothing below the ground's frame but what moves
            assert p < j

    def rotations(self, G):
        out = []
        for d in self.drive:
            if d is None:
                out.append(np.broadcast_to(np.eye(3), (len(G), 3, 3)))
                continue
            a, b, w = NAMES.index(d[0]), NAMES.index(d[1]), d[2]
            out.append(G[:, a] if w == 0 or a == b else orthonormal((1 - w) * G[:, a] + w * G[:, b]))
        return np.stack(out, 1)

    def part(self, j):
        return self.drive[j][0] if self.drive[j] else None


def rest_pose(rig, kind, rng):
    """R_n: how each joint is turned at rest, from T-pose."""
    n = len(rig.names)
    R = np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
    arm_angle = {"A": 45, "down": 85}.get(kind)
    for j in range(n):
        part = rig.part(j) or ""
        side = 1 if part.startswith("left") else -1
        arm = part.endswith(("shoulder", "elbow", "wrist"))
        if arm and arm_angle:
            R[j] = axis_rotation("Z", -side * arm_angle)
        if arm and kind == "forward":
            R[j] = axis_rotation("Y", -side * 88)
        if kind == "A" and part.endswith(("hip", "knee")):
            R[j] = axis_rotation("Z", side * 8)
    if kind == "random":
        for j in range(n):
            R[j] = turn(rng.normal(size=3), rng.uniform(0, 180))
    if kind == "along-x":  # every bone along +X
        for j in range(n):
            child = next((k for k in range(n) if rig.parents[k] == j and np.linalg.norm(rig.T[k] - rig.T[j]) > 1e-6), None)
            v = rig.T[child] - rig.T[j] if child is not None else None
            if v is None:
                R[j] = R[rig.parents[j]] if rig.parents[j] >= 0 else R[j]
                continue
            v = v / np.linalg.norm(v)
            axis = np.cross(v, [1, 0, 0])
            R[j] = turn(axis if np.linalg.norm(axis) > 1e-6 else [0, 1, 0], np.degrees(np.arccos(np.clip(v[0], -1, 1))))
    for j in range(n):
        part = rig.part(j) or ""
        side = 1 if part.startswith("left") else -1
        if kind == "toes-down" and part.endswith(("ankle", "foot")):
            R[j] = axis_rotation("X", 70)
        if kind == "elbows" and part.endswith(("elbow", "wrist")):
            R[j] = axis_rotation("Y", -side * 80)
        if kind == "feet-out" and part.endswith(("ankle", "foot")):
            R[j] = axis_rotation("Y", side * 35)
        if kind == "sitting" and part.endswith("hip"):
            R[j] = axis_rotation("X", -88)
    if kind == "lying":
        R = axis_rotation("X", -90) @ R
    if kind == "lying-x":
        R = axis_rotation("Z", 90) @ R
    return R


UNITS = {"m": 1, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "cmu": 0.0254 / 0.45}


class Writer:
    def __init__(self, folder):
        self.folder, self.count, self.truth = folder, 0, {}
        os.makedirs(folder, exist_ok=True)

    def world(self, v):
        """Rotation from the truth's axes to the file's."""
        facing = {"+z": 0, "+x": 90, "-z": 180, "-x": 270}.get(v["facing"], v["facing"])
        a = axis_rotation("Y", facing)
        return (axis_rotation("X", 90) @ a) if v["up"] == "z" else a

    def bvh(self, label, motion, rig_name, **options):
        v = dict(unit="cm", up="y", facing="+z", rest_facing=0, rest="T", order="ZXY", rate=120, seconds=2.0, start=(0, 0, 0), height=0.0, digits=6, channels="plain", text="lf", pose="upright", size=1.0, first="motion",
                 reflect=False, frames=None, frame_time=None, first_at=0.3, expect="clip", rest_up=None, reference=0, root_offset=(0, 0, 0), noise=1e-3)
        v.update(options)
        rng = np.random.default_rng(sum(map(ord, label)))
        rig_ = Rig(RIGS[rig_name] if rig_name in RIGS else BEASTS[rig_name], motion, rng)
        n = len(rig_.names)
        frames = v["frames"] or int(min(v["seconds"], motion.seconds - v["first_at"]) * v["rate"])
        times = v["first_at"] + np.arange(frames) / v["rate"]
        G, root = motion.at(times)
        G, root = posed(v["pose"], G, root, motion, times)
        W = rig_.rotations(G)
        p = np.zeros((frames, n, 3))
        A = self.world(v)
        pelvis = next(j for j in range(n) if rig_.part(j) == "pelvis")
        R = rest_pose(rig_, v["rest"], rng)
        R = axis_rotation("Y", v["rest_facing"]) @ R
        if v["rest"] == "first":
            R = W[0].copy()
        if v["rest"] != "random" and v["rest"] != "along-x":
            for j in range(n):
                if rig_.drive[j] is None:
                    R[j] = axis_rotation("X", v["reference"])
        L, offsets = np.zeros((frames, n, 3, 3)), np.zeros((n, 3))
        scale = v["size"] / UNITS[v["unit"]]
        # The file's axes: everything conjugated by A, or the rest pose left in Y up while the motion is Z up (rest_up).
        B = A if v["rest_up"] is None else np.eye(3)
        world = np.einsum("ij,tnjk,nkl->tnil", A, W, np.einsum("nij->nji", np.einsum("ij,njk->nik", B, R)))
        parents = rig_.parents
        for j in range(n):
            q = parents[j]
            L[:, j] = world[:, j] if q < 0 else np.einsum("tji,tjk->tik", world[:, q], world[:, j])
            if q >= 0:
                offsets[j] = B @ R[q] @ (rig_.T[j] - rig_.T[q]) * scale
        offsets[0] = np.asarray(v["root_offset"], float) * scale
        start = np.asarray(v["start"], float) / UNITS[v["unit"]]
        lift = np.array([0, v["height"], 0])
        path = (root * v["size"] + lift) @ A.T / UNITS[v["unit"]] + start
        moving, root_position = {}, path
        if pelvis > 0:  # a static joint above the body: the travel is in the hips, unless the top joint carries it
            assert rig_.drive[0] is None or rig_.part(0) == "pelvis"
            if rig_.drive[0] is None:
                base = np.einsum("ij,j->i", A, lift) / UNITS[v["unit"]] + start
                root_position = np.broadcast_to(base, path.shape)
                # joint above the hips stands still: positions of the hips are in its frame
                q = parents[pelvis]
                above = root_position + sum((world[:, parents[k]] @ offsets[k] for k in self.ancestors(parents, q)), np.zeros(3))
                moving[pelvis] = np.einsum("tji,tj->ti", world[:, q], path - above)
        if v["channels"] == "six":
            for j in range(1, n):
                moving.setdefault(j, np.broadcast_to(offsets[j], (frames, 3)) + rng.normal(0, v["noise"], (frames, 3)))
        if v["reflect"]:
            M = np.diag([-1.0, 1, 1])
            L, offsets, root_position = M @ L @ M, offsets @ M, root_position @ M
            moving = {j: x @ M for j, x in moving.items()}
        if v["first"] != "motion":  # a leading frame of zeros (or several)
            k = int(v["first"])
            L = np.concatenate([np.broadcast_to(np.eye(3), (k, n, 3, 3)), L])
            still = np.zeros((k, 3))
            root_position = np.concatenate([still, root_position])
            moving = {j: np.concatenate([np.broadcast_to(offsets[j], (k, 3)), x]) for j, x in moving.items()}
        orders = [v["order"]] * n
        if v["order"] == "mixed":
            orders = [("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")[int(rng.integers(6))] for _ in range(n)]
        path_name = f"{self.count:03d}_{label}.bvh".replace(" ", "_")
        self.count += 1
        self.text(path_name, rig_, offsets, root_position, moving, L, orders, v, scale)
        self.truth[path_name[:-4]] = dict(label=label, motion=motion.name, t0=v["first_at"], frames=frames, rate=v["rate"], unit=v["unit"], up=v["up"], expect=v["expect"], rest=v["rest"], rig=rig_name, pose=v["pose"],
                                          hidden=[c for c in NAMES if c not in {rig_.part(j) for j in range(n)}])

    def asf(self, label, motion, unit, axes, degrees):
        """CMU's layout: bones with a direction, joints at their bases, values conjugated by each bone's own axes."""
        rng = np.random.default_rng(7)
        bones = [("lowerback", "root", "pelvis", "spine1", "pelvis"), ("upperback", "lowerback", "spine1", "spine2", "spine1"), ("thorax", "upperback", "spine2", "spine3", "spine2"),
                 ("lowerneck", "thorax", "spine3", "neck", "spine3"), ("upperneck", "lowerneck", "neck", "head", "neck"), ("head", "upperneck", "head", None, "head")]
        for s, p in (("l", "left_"), ("r", "right_")):
            bones += [(s + "hipjoint", "root", "pelvis", p + "hip", "pelvis"), (s + "femur", s + "hipjoint", p + "hip", p + "knee", p + "hip"), (s + "tibia", s + "femur", p + "knee", p + "ankle", p + "knee"),
                      (s + "foot", s + "tibia", p + "ankle", p + "foot", p + "ankle"), (s + "toes", s + "foot", p + "foot", None, p + "foot"), (s + "clavicle", "thorax", "spine3", p + "shoulder", p + "collar"),
                      (s + "humerus", s + "clavicle", p + "shoulder", p + "elbow", p + "shoulder"), (s + "radius", s + "humerus", p + "elbow", p + "wrist", p + "elbow"), (s + "wrist", s + "radius", p + "wrist", None, p + "wrist")]
        number = unit / 0.0254  # length in the file of a metre
        angle = 1 if degrees else np.pi / 180
        T = {**motion.T}
        out = [":version 1.10", ":name VICON", ":units", "  mass 1.0", f"  length {unit}", "  angle " + ("deg" if degrees else "rad"), ":documentation", "   made", ":root", "   order TX TY TZ RX RY RZ", "   axis XYZ", "   position 0 0 0", "   orientation 0 0 0", ":bonedata"]
        C, free = {"root": np.eye(3)}, {}
        driver = {"root": "pelvis"}
        for k, (name, parent, base, tip, d) in enumerate(bones):
            v = T[tip] - T[base] if tip else motion.tips[base]
            a = rng.uniform(-80, 80, 3)
            C[name] = np.eye(3)
            for axis, value in zip(axes, a):  # the first listed is applied first
                C[name] = axis_rotation(axis, value) @ C[name]
            driver[name] = d
            free[name] = driver[parent] != d
            direction = v / np.linalg.norm(v)
            out += ["  begin", f"     id {k + 1}", f"     name {name}", "     direction {:.9f} {:.9f} {:.9f}".format(*direction), f"     length {np.linalg.norm(v) * number:.8f}", "     axis {:.6f} {:.6f} {:.6f}   {}".format(*(a * angle), axes)]
            if free[name]:
                out += ["    dof rx ry rz", "    limits (-360.0 360.0)", "           (-360.0 360.0)", "           (0 0)"]
            out.append("  end")
            C[name] = C[name]
        out += [":hierarchy", "  begin"]
        for parent in ["root"] + [b[0] for b in bones]:
            kids = [b[0] for b in bones if b[1] == parent]
            if kids:
                out.append(f"    {parent} {' '.join(kids)}")
        out.append("  end")
        stem = f"{self.count:03d}_{label}".replace(" ", "_").replace(".", "-")
        self.count += 1
        open(os.path.join(self.folder, stem + ".asf"), "w").write("\n".join(out) + "\n")
        times = 0.3 + np.arange(240) / 120
        G, root = motion.at(times)
        world = lambda n: G[:, NAMES.index(driver[n])]
        values = {"root": np.concatenate([root * number, euler(world("root"), "ZYX")[:, ::-1] * angle], 1)}
        for name, parent, *_ in bones:
            if free[name]:
                local = np.einsum("tji,tjk->tik", world(parent), world(name))
                values[name] = euler(C[name].T @ local @ C[name], "ZYX")[:, ::-1] * angle
        lines = ["#!OML:ASF x", ":FULLY-SPECIFIED", ":DEGREES" if degrees else ":RADIANS"]
        for t in range(len(times)):
            lines.append(str(t + 1))
            lines += [f"{n} " + " ".join("%.8g" % x for x in v[t]) for n, v in values.items()]
        open(os.path.join(self.folder, stem + ".amc"), "w").write("\n".join(lines) + "\n")
        self.truth[stem] = dict(label=label, motion=motion.name, t0=0.3, frames=240, rate=120, unit="asf", up="y", expect="clip", rest="T", rig="asf", pose="upright", hidden=[])

    def amass(self, label, motion, release):
        rate = {"smplh": 120, "smplx": 60, "stageii": 100}[release]
        times = 0.3 + np.arange(2 * rate) / rate
        G, root = motion.at(times)
        order = "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 left_foot right_foot neck left_collar right_collar head left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist".split()
        A = axis_rotation("X", 90) @ axis_rotation("Y", 70)  # Z up
        poses = np.zeros((len(times), 156 if release == "smplh" else 165))
        for k, name in enumerate(order):
            g = G[:, NAMES.index(name)]
            q = motion.parent[name]
            local = A @ g if q is None else np.einsum("tji,tjk->tik", G[:, NAMES.index(q)], g)
            poses[:, 3 * k:3 * k + 3] = rotation_vectors(local)
        content = dict(poses=poses, trans=root @ A.T - [-0.00179506, -0.22333382, 0.02821918] + [3, 4, 0], betas=np.zeros(16), gender=np.array("male"))
        content["mocap_framerate" if release == "smplh" else "mocap_frame_rate"] = np.array(float(rate))
        if release == "stageii":
            content.update(surface_model_type=np.array("smplx"), root_orient=poses[:, :3], pose_body=poses[:, 3:66], pose_hand=poses[:, 75:], pose_jaw=poses[:, 66:69], pose_eye=poses[:, 69:75])
            del content["poses"]
        stem = f"{self.count:03d}_{label}" .replace(" ", "_") + ("_stageii" if release == "stageii" else "")
        self.count += 1
        (np.savez if release != "smplx" else np.savez_compressed)(os.path.join(self.folder, stem + ".npz"), **content)
        self.truth[stem] = dict(label=label, motion=motion.name, t0=0.3, frames=len(times), rate=rate, unit="m", up="z", expect="clip", rest="T", rig="smpl", pose="upright", hidden=[])

    @staticmethod
    def ancestors(parents, j):
        out = []
        while j > 0:
            out.append(j)
            j = parents[j]
        return out[::-1]

    def text(self, name, rig_, offsets, root_position, moving, L, orders, v, scale):
        n, parents = len(rig_.names), rig_.parents
        kids = [[k for k in range(n) if parents[k] == j] for j in range(n)]
        up, low = (str.lower, str.lower) if v["text"] == "lower" else (str, str)
        out, columns = [up("HIERARCHY")], []
        number = "{:.%df}" % v["digits"]
        fmt3 = lambda x: " ".join(number.format(c) for c in x)
        rotation = np.stack([euler(L[:, j], orders[j]) for j in range(n)], 1)

        def visit(j, depth):
            tab = "\t" * depth if v["text"] != "spaces" else "  " * depth
            out.append(f"{tab}{up('ROOT' if depth == 0 else 'JOINT')} {rig_.names[j]}")
            out.append(tab + "{")
            out.append(f"{tab}\t{up('OFFSET')} {fmt3(offsets[j])}")
            places = depth == 0 and v["channels"] != "no-root-positions" or j in moving
            pos = [low(c + "position") for c in "XYZ"] if places else []
            rot = [low(c + "rotation") for c in orders[j]]
            first, second = (rot, pos) if v["channels"] == "after" else (pos, rot)
            out.append(f"{tab}\t{up('CHANNELS')} {len(first + second)} {' '.join(first + second)}")
            x = root_position if depth == 0 else moving.get(j)
            blocks = [rotation[:, j]]
            if places:
                blocks.insert(len(blocks) if v["channels"] == "after" else 0, x)
            columns.extend(blocks)
            for k in kids[j]:
                visit(k, depth + 1)
            if not kids[j] and v["text"] != "no-ends":
                part = rig_.part(j)
                tip = self.tip(rig_, j, part) * scale
                out.append(f"{tab}\t{'End Site' if v['text'] != 'lower' else 'end site'}\n{tab}\t{{\n{tab}\t\t{up('OFFSET')} {fmt3(tip)}\n{tab}\t}}")
            out.append(tab + "}")
        visit(0, 0)
        rows = np.concatenate(columns, 1)
        out.append(up("MOTION"))
        out.append(f"Frames: {len(rows)}")
        out.append("Frame Time: " + (v["frame_time"] or f"{1 / v['rate']:.8f}"))
        form = "%.6e" if v["text"] == "exponents" else f"%.{v['digits']}f"
        line = ("\t" if v["text"] == "tabs" else " ").join([form] * rows.shape[1])
        out += [line % tuple(r) for r in rows]
        text = "\n".join(out) + "\n"
        if v["text"] == "blank":
            text += "\n\n  \n"
        if v["text"] == "crlf":
            text = text.replace("\n", "\r\n")
        if v["text"] == "bom":
            text = "\ufeff" + text
        open(os.path.join(self.folder, name), "w", newline="").write(text)

    @staticmethod
    def tip(rig_, j, part):
        t = rig_.body.tips.get(part)
        return t * 0.5 if t is not None else np.array([0, 0.02, 0])


def posed(kind, G, root, body, times):
    """The whole figure otherwise than upright, or as it is. Rotations about the pelvis, which is brought to a sensible height."""
    if kind == "upright":
        return G, root
    Q = {"lying": axis_rotation("X", -90), "prone": axis_rotation("X", 88), "handstand": axis_rotation("X", 180), "side": axis_rotation("Z", 90), "crawl": axis_rotation("X", 80)}.get(kind, np.eye(3))
    if kind == "sitting":
        G = G.copy()
        for s in SIDES:
            G[:, NAMES.index(s + "_hip")] = axis_rotation("X", -85 + 4 * np.sin(times))
            for c in ("_knee", "_ankle", "_foot"):
                G[:, NAMES.index(s + c)] = axis_rotation("X", 3 * np.sin(3 * times) + (4 if s == "left" else 0))
        path = np.broadcast_to(root[:1] * [1, 0, 1] + [0, 0.5, 0], root.shape) + 0
        for s, c in ((s, c) for s in SIDES for c in ("shoulder", "elbow", "wrist")):
            G[:, NAMES.index(f"{s}_{c}")] = axis_rotation("Z", -70 if s == "left" else 70) @ axis_rotation("Y", 20 * np.sin(4 * times))
        return G, path
    if kind in ("lying", "prone", "side"):
        G = orthonormal(0.85 * np.eye(3) + 0.15 * G)
        for s in SIDES:
            for c in ("_shoulder", "_elbow", "_wrist"):
                G[:, NAMES.index(s + c)] = axis_rotation("Z", -80 if s == "left" else 80)
    G = Q @ G
    height = {"lying": 0.12, "prone": 0.15, "side": 0.2, "handstand": 1.25, "crawl": 0.55}.get(kind, 0.5)
    path = root.copy()
    if kind in ("lying", "side"):
        path[:, [0, 2]] = path[:1, [0, 2]]
    path[:, 1] = height
    if kind == "crawl":  # thighs down, shanks back, arms down
        for s in SIDES:
            for c, q in ((s + "_hip", axis_rotation("X", 5)), (s + "_knee", axis_rotation("X", 85)), (s + "_ankle", axis_rotation("X", 120)), (s + "_foot", axis_rotation("X", 120))):
                phase = 15 * np.sin(2 * np.pi * times + (0 if s == "left" else np.pi))
                G[:, NAMES.index(c)] = axis_rotation("X", phase) @ q
            for c in ("_shoulder", "_elbow", "_wrist"):
                G[:, NAMES.index(s + c)] = axis_rotation("X", 10 * np.sin(2 * np.pi * times)) @ axis_rotation("Z", -85 if s == "left" else 85)
    return G, path


def load(corpus):
    motions = {}
    for f in sorted(os.listdir(corpus)):
        if f.endswith(".bvh"):
            m = Motion(os.path.join(corpus, f))
            m.name = f[:-4]
            # height of the pelvis above the sole with straight legs
            m.floor = -(m.T["left_foot"] + m.tips["left_foot"])[1] + 0.01
            motions[m.name.split("_")[0]] = m
    return motions


def write_all(corpus, folder):
    motions = load(corpus)
    w = Writer(folder)
    walk, jog, lift, jump = (motions[k] for k in ("walking", "jogging", "lifting", "jumping"))
    cycle = [walk, lift, jog, jump]
    for k, name in enumerate(RIGS):  # every rig, as its own writers rest it
        rest = {"metarig": "A", "rigify-def": "A", "vrm": "T", "biovision": "down", "biovision-2": "down", "lafan1": "T", "bandai": "along-x", "kinect": "random", "kinect-azure": "random", "unreal": "A", "makehuman": "A", "eyes-japan": "T"}.get(name, "T")
        unit = {"unreal": "cm", "metarig": "m", "vrm": "m", "kinect": "m", "kinect-azure": "mm", "cgspeed": "cmu", "hdm05": "in", "motive": "mm", "makehuman": "dm", "smpl": "m", "vrm-humanoid": "m", "poser": "in"}.get(name, "cm")
        w.bvh(f"rig {name}", cycle[k % 4], name, rest=rest, unit=unit, up="z" if name in ("unreal", "xsens-mvn", "biped", "advanced-skeleton") else "y", order=("ZXY", "ZYX", "XYZ", "YXZ", "ZXY", "YZX", "XZY")[k % 7])
    for unit in UNITS:
        w.bvh(f"unit {unit}", walk, "lafan1", unit=unit)
        w.bvh(f"unit {unit} z", lift, "mixamo", unit=unit, up="z")
    for up in "yz":
        for facing in ("+z", "-z", "+x", "-x", 37):
            w.bvh(f"facing {facing} {up}", walk, "humanik", facing=facing, up=up, rest_facing=(0, 90, 180, 270, 45)[len(str(facing)) + "yz".index(up)])
            w.bvh(f"facing {facing} {up} rest alike", jog, "lafan1", up=up, facing=facing, rest_facing=0)
    for rest in ("T", "A", "down", "forward", "random", "along-x", "lying", "lying-x"):
        for up in "yz":
            for m, r in ((walk, "rokoko"), (lift, "cgspeed"), (jump, "no-clavicle")):
                w.bvh(f"rest {rest} {up} {r}", m, r, rest=rest, up=up, rest_facing=120 if up == "z" else 0)
    for r in ("mixamo", "biped", "lafan1"):  # the world turned to Z up by the root alone, the rest pose left as it was
        w.bvh(f"rest y motion z {r}", walk, r, up="z", rest_up="y")
        w.bvh(f"rest y motion z {r} lift", lift, r, up="z", rest_up="y", facing="-x")
    for order in ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX", "mixed"):
        w.bvh(f"order {order}", lift, "neuron", order=order)
    for channels in ("six", "after", "no-root-positions"):
        w.bvh(f"channels {channels}", walk, "humanik" if channels != "no-root-positions" else "lafan1", channels=channels, expect="no-travel" if channels == "no-root-positions" else "clip")
        w.bvh(f"channels {channels} 2", jump, "rokoko", channels=channels, order="mixed", expect="no-travel" if channels == "no-root-positions" else "clip")
    w.bvh("channels six m", walk, "rokoko", channels="six", unit="m", noise=1e-3 * 0.01)
    w.bvh("channels six mm", walk, "rokoko", channels="six", unit="mm")
    for text in ("crlf", "tabs", "exponents", "bom", "lower", "blank", "no-ends", "spaces"):
        w.bvh(f"text {text}", walk, "xsens", text=text)
    w.bvh("text digits 4", walk, "mixamo", digits=4, unit="m")
    w.bvh("text digits 2", walk, "mixamo", digits=2)
    for rate, time in ((30, "0.0333"), (30, "0.033333"), (120, "0.0083333"), (120, "0.00833334"), (25, "0.04"), (24000 / 1001, "0.0417083"), (60000 / 1001, "0.016683"), (60000 / 1001, "0.01668335"), (100, "0.01"), (250, "0.004"), (29.97, "0.0333667"), (60, "0.0166667"), (60, "0.0167"),
                       (90, "0.0111111"), (144, "0.00694444"), (120, "0.008333"), (240, "0.0041667"), (50, "2e-2"), (72, "0.0138889"), (48, "0.020833"), (59.94, "0.016683350")):
        w.bvh(f"time {time}", jog, "lafan1", rate=rate, frame_time=time)
    for frames in (1, 2, 3, 7):
        w.bvh(f"frames {frames}", walk, "mixamo", frames=frames)
        w.bvh(f"frames {frames} random", walk, "mixamo", frames=frames, rest="random", expect="readable")
    for start in ((30, 0, -40), (-5, 3.5, 2), (0, -1.2, 0)):
        w.bvh(f"start {start}", walk, "rokoko", start=start)
    w.bvh("start z", jump, "rokoko", start=(12, -30, 2.2), up="z")
    for size, unit in ((0.6, "cm"), (0.6, "m"), (1.25, "cm"), (1.25, "mm"), (0.75, "in")):
        w.bvh(f"size {size} {unit}", walk, "mixamo", size=size, unit=unit)
    for first in (1, 2):
        for rest in ("T", "A", "down", "random", "along-x"):
            w.bvh(f"first {first} {rest}", lift if rest == "T" else walk, "mixamo", first=first, rest=rest)
        w.bvh(f"first {first} T z", jog, "cgspeed", first=first, up="z", rest_facing=45)
    for pose in ("lying", "prone", "side", "handstand", "crawl"):
        for up in "yz":
            for facing in ("+z", "+x"):
                w.bvh(f"pose {pose} {up} {facing}", walk, "rokoko", pose=pose, up=up, facing=facing)
        w.bvh(f"pose {pose} start", walk, "lafan1", pose=pose, start=(3, 0, 2), rest="A", facing="-z")
        w.bvh(f"pose {pose} random", walk, "lafan1", pose=pose, rest="random", expect="clip" if pose in ("handstand", "crawl") else "readable")  # nothing tells which way is up
    for m in (walk, jog, lift, jump):
        w.bvh("reflected " + m.name, m, "lafan1", reflect=True, expect="refused")
        w.bvh("reflected z " + m.name, m, "mixamo", reflect=True, up="z", expect="refused")
        w.bvh("reflected random " + m.name, m, "rokoko", reflect=True, rest="random", expect="refused")
        w.bvh("reflected no toes " + m.name, m, "biovision", reflect=True, expect="refused" if m is not lift else "any")
    for rest in ("toes-down", "elbows", "feet-out", "sitting", "first"):
        for up in "yz":
            w.bvh(f"rest {rest} {up} walk", walk, "lafan1", rest=rest, up=up)
            w.bvh(f"rest {rest} {up} lift", lift, "mixamo", rest=rest, up=up, facing="-x", rest_facing=90)
    for angle in (90, -90):
        w.bvh(f"reference turned {angle}", walk, "humanik", reference=angle)
        w.bvh(f"reference turned {angle} z", jump, "unreal", reference=angle, up="z", unit="m")
    w.bvh("root offset", walk, "lafan1", root_offset=(0, 0.95, 0))
    w.bvh("root offset far", jog, "mixamo", root_offset=(-3, 0.95, 4), start=(2, 0, 1))
    for up in "yz":
        for name in ("rokoko", "biovision"):
            for rest in ("T", "random"):
                w.bvh(f"pose sitting {up} {name} {rest}", walk, name, pose="sitting", up=up, rest=rest)
    for rate, time in ((240, "0.0042"), (180, "0.0056"), (144, "0.0069"), (30, "0.033"), (60, "0.017"), (24, "0.042"), (125, "0.008"), (200, "0.005"), (30000 / 1001, "0.0334"), (120, "0.00833")):
        w.bvh(f"time coarse {time}", jog, "lafan1", rate=rate, frame_time=time)
    for name in BEASTS:
        w.bvh(f"beast {name}", walk, name, expect="beast")
    for k, (unit, axes, degrees) in enumerate(((0.45, "XYZ", True), (1.0, "XYZ", True), (0.45, "ZYX", True), (0.45, "YZX", False), (2.54, "XYZ", False))):
        w.asf(f"asf {unit} {axes} {'deg' if degrees else 'rad'}", cycle[k % 4], unit, axes, degrees)
    for release in ("smplh", "smplx", "stageii"):
        for m in (walk, jump):
            w.amass(f"amass {release} {m.name.split('_')[0]}", m, release)
    rng = np.random.default_rng(5)
    pick = lambda *a: a[int(rng.integers(len(a)))]
    for k in range(40):  # everything at once
        rest, up = pick("T", "A", "down", "forward", "random", "along-x", "lying"), pick("y", "z")
        name = pick(*RIGS)
        w.bvh(f"any {k} {name} {rest} {up}", pick(*cycle), name, rest=rest, up=up, unit=pick(*UNITS), facing=float(rng.uniform(0, 360)), rest_facing=pick(0, 90, 180, 270), order=pick("mixed", "ZYX", "ZXY"), channels=pick("plain", "plain", "after", "six"),
              rate=pick(120, 60, 30, 100, 50), start=tuple(rng.normal(0, 3, 3) * [1, 0.2, 1] if up == "y" else rng.normal(0, 3, 3) * [1, 1, 0.2]), size=pick(1, 1, 0.8, 1.1), text=pick("lf", "crlf", "tabs", "no-ends"), first_at=float(rng.uniform(0, 1.5)), noise=0)
    json.dump({k: v for k, v in w.truth.items()}, open(os.path.join(folder, "truth.json"), "w"))
    return w


def read_archive(path):
    import h5py

    f = h5py.File(path)
    names = [n.decode() for n in f["skeleton/joint_names"][:]]
    parents, offsets = f["skeleton/parents"][:], f["skeleton/rest_offsets"][:].astype(float)
    out = {}
    for i, clip in enumerate(f["clips/name"][:]):
        rows = slice(f["clips/start"][i], f["clips/start"][i] + f["clips/length"][i])
        q = f["frames/rotations"][rows].astype(float)
        w, x, y, z = np.moveaxis(q, -1, 0)
        m = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], -1).reshape(q.shape[:2] + (3, 3))
        world, p = [m[:, 0]], [f["frames/root_position"][rows].astype(float)]
        for j in range(1, len(names)):
            k = parents[j]
            p.append(p[k] + world[k] @ offsets[j])
            world.append(world[k] @ m[:, j])
        order = [names.index(n) for n in NAMES]
        C = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]], float)  # Z up, facing +X to Y up, facing +Z
        out[clip.decode()] = dict(W=C @ np.stack(world, 1)[:, order] @ C.T, p=np.stack(p, 1)[:, order] @ C.T, contacts=f["frames/contacts"][rows], unit=f["clips/source_unit"][i].decode(), up=f["clips/source_up_axis"][i].decode(),
                                  rate=float(f["clips/source_frame_rate_hz"][i]))
    return out


LIMBS = [(s + a, s + b) for s in ("left_", "right_") for a, b in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))]
TRUNK = [("pelvis", "spine3"), ("spine3", "neck"), ("neck", "head")]


def across(p):
    at = lambda n: p[:, NAMES.index(n)]
    return at("left_hip") - at("right_hip") + at("left_shoulder") - at("right_shoulder")


def check_all(corpus, folder, archive, rejects):
    motions, truth, clips = load(corpus), json.load(open(os.path.join(folder, "truth.json"))), read_archive(archive)
    refused = {}
    for line in open(rejects).read().split("\n")[1:]:
        if line:
            cells = line.split("\t")
            refused[os.path.basename(cells[0])[:-4]] = cells[3]
    problems, table, worst = [], {}, {}
    reference = {k: v for k, v in clips.items() if k not in truth}
    for key, t in truth.items():
        kind = t["label"].split()[0]
        count = table.setdefault(kind, [0, 0])
        count[0] += 1
        wrong = judge(key, t, motions[t["motion"].split("_")[0]], clips.get(key), refused.get(key), reference, worst)
        count[1] += not wrong
        problems += [f"{key}: {x}" for x in wrong]
    for kind, (tried, right) in table.items():
        print(f"{kind}\t{tried}\t{right}")
    if os.environ.get("DIALECTS_VERBOSE"):
        for k, v in worst.items():
            print("   worst", k, v)
    for p in problems:
        print("  " + p)
    return bool(problems)


def angle(a, b):
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(-1)))


def judge(key, t, body, clip, refusal, reference, worst):
    if t["expect"] == "any":  # a lift bends its knees either way too little to tell
        return []
    if t["expect"] == "refused":
        return [] if refusal and "left" in refusal else [f"not refused as a reflection: {refusal}"]
    if t["expect"] == "beast":
        return [] if refusal and "no joint found for" in refusal and "not placed" in refusal else [f"not refused with its joints: {refusal}"]
    if clip is None:
        return [f"refused: {refusal}"]
    if t["expect"] == "readable":
        return []
    out = []
    n = len(clip["p"])
    times = np.arange(n) / 30
    expected = int((t["frames"] - 1) / t["rate"] * 30 + 1e-6) + 1
    if abs(n - expected) > 0:
        out.append(f"{n} frames, expected {expected}")
    if abs(clip["rate"] / t["rate"] - 1) > 1e-4:
        out.append(f"rate {clip['rate']}, expected {t['rate']}")
    if clip["unit"] != t["unit"]:
        out.append(f"unit {clip['unit']}, expected {t['unit']}")
    if clip["up"] != t["up"]:
        out.append(f"up axis {clip['up']}, expected {t['up']}")
    note = lambda k, v: worst.__setitem__(k, max(worst.get(k, (0, "")), (round(float(v), 3), key)))
    G, root = body.at(t["t0"] + times)
    G, root = posed(t["pose"], G, root, body, t["t0"] + times)
    p = pose_of(body, G, root)
    p = np.stack([p[c] for c in NAMES], 1)
    q, W = clip["p"], clip["W"]
    # The first frame faces +Z here; the truth is turned likewise.
    a = across(p)[0] * [1, 0, 1]
    b = across(q)[0] * [1, 0, 1]
    if np.linalg.norm(a) > 0.06 and angle(b, np.array([1.0, 0, 0])) > 0.5:
        out.append(f"first frame's across-vector {b}, expected along +X")
    # Turned so that the first poses fit: the facing of a rig without clavicles or spine is not quite the truth's.
    known = [k for k, c in enumerate(NAMES) if c not in t["hidden"]]
    u, v = (x[0, known] - x[0, known].mean(0) for x in (p, q))
    fitted = np.degrees(np.arctan2((u[:, 2] * v[:, 0] - u[:, 0] * v[:, 2]).sum(), (u[:, 0] * v[:, 0] + u[:, 2] * v[:, 2]).sum()))
    Y = axis_rotation("Y", fitted)
    if np.linalg.norm(a) > 0.06:
        off = abs((fitted - np.degrees(np.arctan2(a[2], a[0])) + 180) % 360 - 180)
        note("heading", off)
        if off > (12 if t["hidden"] else 4):
            out.append(f"first heading {off:.1f} degrees off")
    p, G = p @ Y.T, Y @ G
    at = lambda x, c: x[:, NAMES.index(c)]
    mean = lambda pairs: np.mean([angle(at(p, e) - at(p, s), at(q, e) - at(q, s)).mean() for s, e in pairs if e not in t["hidden"] and s not in t["hidden"]])
    limbs = mean(LIMBS)
    trunk = mean([(s, e) for s, e in TRUNK]) if not {"neck", "head", "spine3"} & set(t["hidden"]) else 0
    few = t["frames"] < 10
    loose = t["rest"] in ("random", "along-x", "first")
    note("limbs", limbs), note("trunk", trunk)
    if limbs > 3:
        out.append(f"limbs {limbs:.1f} degrees off, expected at most 3")
    if trunk > 8:
        out.append(f"trunk {trunk:.1f} degrees off, expected at most 8")
    hinge = lambda x, s: (np.cross(at(x, s + "_knee") - at(x, s + "_hip"), at(x, s + "_ankle") - at(x, s + "_knee")) * across(x)).sum(-1)
    for s in SIDES:
        if (hinge(q, s) < -0.01).mean() > (hinge(p, s) < -0.005).mean() + 0.02:
            out.append(f"{s} knee bends forwards")
    if limbs <= 3:  # orientations, where places are right: pelvis, head, feet, hands
        for c in NAMES:
            if c in t["hidden"] or (c.endswith("elbow") and c.replace("elbow", "wrist") in t["hidden"]):
                continue
            off = np.degrees(np.arccos(np.clip((np.einsum("tij,tij->t", at(G, c), at(W, c)) - 1) / 2, -1, 1))).mean()
            note(f"{'loose' if loose else 'rest'} {c}", off)
            limit = 90 if loose or few else 45 if c in ("neck", "spine1", "spine2", "spine3", "left_collar", "right_collar") else 12
            if off > limit:
                out.append(f"{c} turned by {off:.0f} degrees, expected at most {limit}")
    if t["pose"] == "handstand" and q[:, :, 1].min() < -0.02:
        out.append(f"{-q[:, :, 1].min():.2f} m under the floor")
    if t["pose"] == "upright" and t["expect"] == "clip" and not few:
        sole = np.minimum(at(q, "left_foot"), at(q, "right_foot"))[:, 1]
        still = clip["contacts"].any(1)
        level = np.percentile(sole[still], 25) - 0.025 if still.any() else sole.min() - 0.025
        note("sole", abs(level))
        if abs(level) > 0.02:
            out.append(f"soles at {level:.3f} m, expected 0")
        legs = lambda x: np.linalg.norm(x, axis=-1)
        scale = sum(np.linalg.norm(body.T["left_" + e] - body.T["left_" + s]) for s, e in (("hip", "knee"), ("knee", "ankle"))) / 0.8193
        travel, own = (at(q, "pelvis") - at(q, "pelvis")[:1])[:, [0, 2]], (at(p, "pelvis") - at(p, "pelvis")[:1])[:, [0, 2]]
        off = legs(travel - own * (legs(travel).max() / max(legs(own).max(), 1e-9)))
        note("travel", off.max())
        if off.max() > (0.15 if t["hidden"] else 0.08):
            out.append(f"path up to {off.max():.2f} m off")
        if legs(own).max() > 0.5 and not 0.85 < legs(travel).max() / legs(own).max() < 1.2:
            out.append(f"travels {legs(travel).max():.2f} m, expected {legs(own).max():.2f}")
        key_ref = next((k for k in reference if k == t["motion"]), None)
        if key_ref and t["rate"] == 120 and t["t0"] == 0.3 and not loose:
            known = reference[key_ref]["contacts"][9:9 + n]
            m = min(len(known), n)
            agree = (known[:m] == clip["contacts"][:m]).mean()
            worst["contacts"] = min(worst.get("contacts", (1, "")), (round(float(agree), 3), key))
            if agree < 0.85:
                out.append(f"contacts agree in {100 * agree:.0f} %, expected at least 85")
    return out


def mutilate(folder, out, count):
    """Files cut off, with bytes changed, pieces missing or twice, lines exchanged, numbers that are none."""
    rng = np.random.default_rng(11)
    files = sorted(f for f in os.listdir(folder) if not f.endswith(".json"))
    os.makedirs(out)
    words = [b"nan", b"1e400", b"-", b"1,5", b"9" * 400, b"{", b"}", b"\x00", b"JOINT", b"MOTION", b"End Site", b"-inf", b"CHANNELS 6", b"\xff\xfe", b"18446744073709551616", b""]
    for k in range(count):
        name = files[int(rng.integers(len(files)))]
        data = bytearray(open(os.path.join(folder, name), "rb").read())
        for _ in range(1 if rng.random() < 0.7 else 3):
            head = max(1, data.find(b"MOTION") + 60) if rng.random() < 0.6 else len(data)  # the hierarchy has most to break
            a, b = sorted(int(x) for x in rng.integers(0, max(2, min(head, len(data))), 2))
            kind = int(rng.integers(14))
            if kind == 0:
                del data[int(rng.integers(0, max(1, len(data)))):]
            elif kind == 1:
                for i in rng.integers(0, max(1, len(data)), 8):
                    if data:
                        data[int(i)] = int(rng.integers(256))
            elif kind == 2:
                del data[a:a + 200 if rng.random() < 0.7 else b]
            elif kind == 3:
                data[b:b] = data[a:a + 300]
            elif kind == 4:
                lines = data.split(b"\n")
                i, j = (int(x) for x in rng.integers(0, min(len(lines), 200), 2))
                lines[i], lines[j] = lines[j], lines[i]
                data = bytearray(b"\n".join(lines))
            elif kind > 6:  # digits for digits: still a number, and another motion
                for i in rng.integers(0, len(data), 200) if len(data) else ():
                    if 48 <= data[int(i)] < 58:
                        data[int(i)] = int(rng.integers(48, 58))
            else:
                end = next((i for i in range(a, min(a + 50, len(data))) if data[i] in b" \n"), a)
                data[a:end] = words[int(rng.integers(len(words)))]
        stem, ending = os.path.splitext(name)
        open(os.path.join(out, f"{k:03d}_{stem}{ending}"), "wb").write(data)
        if ending in (".amc", ".asf"):  # its other half, whole
            other = stem + (".asf" if ending == ".amc" else ".amc")
            open(os.path.join(out, f"{k:03d}_{other}"), "wb").write(open(os.path.join(folder, other), "rb").read())


if __name__ == "__main__":
    if sys.argv[1] == "write":
        write_all(sys.argv[2], sys.argv[3])
    elif sys.argv[1] == "mutilate":
        mutilate(sys.argv[2], sys.argv[3], int(sys.argv[4]))
    else:
        sys.exit(check_all(*sys.argv[2:6]))
