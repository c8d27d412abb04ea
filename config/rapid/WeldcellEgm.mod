MODULE WeldcellEgm
  ! Resident side of weldcell on an IRC5 controller (RobotWare 6.10 or later, option 689-1 EGM).
  ! Copy it to $HOME, or let weldcelld load it over Robot Web Services. It is never rewritten by a job.
  !
  ! Before the first use, on the controller:
  !   1. Communication, Transmission Protocol: Name ROB_1, Type UDPUC, Remote Address = the computer that
  !      runs weldcelld, Remote Port Number = egm port of cell.yaml (6511 unless changed). Restart.
  !   2. Motion, External Motion Interface Data: Name default, Level 0,
  !      Default Proportional Position Gain 20, Default Low Pass Filter Bandwidth 100,
  !      Default Ramp Time 0.1, Do Not Restart after Motors Off TRUE.
  !   3. tWeldcellHead below: mass and centre of gravity of everything on the flange (torch, laser,
  !      projector, bracket), as identified by LoadIdentify.
  !   4. \CommTimeout and \MaxSpeedDeviation below: the same as egm.comm_timeout_s and
  !      egm.max_speed_deviation_deg_s of cell.yaml.
  !
  ! How weldcelld uses it: it writes jWeldcellStart, sets the program pointer to WeldcellMove or
  ! WeldcellScan, and starts with cycle=once. It reads nWeldcellState. WeldcellScan has no end of its
  ! own: it ends when weldcelld stops the program, or by time-out when weldcelld is silent.

  ! Where a move ends and a scan begins, degrees. Written by weldcelld.
  PERS jointtarget jWeldcellStart:=[[0,0,0,0,30,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  ! Whole head on the flange, tool frame = flange: [holds, [frame], [kg, [cog mm], [axes], inertia]].
  PERS tooldata tWeldcellHead:=[TRUE,[[0,0,0],[1,0,0,0]],[6.5,[0,0,110],[1,0,0,0],0,0,0]];

  ! 0 idle, 1 moving to jWeldcellStart, 2 there and at rest, 3 following weldcelld over EGM,
  ! 4 EGM ended in order, 9 EGM ended because weldcelld fell silent. Read by weldcelld.
  PERS num nWeldcellState:=0;

  VAR egmident egmWeldcell;
  ! A band that a moving or resting joint never satisfies for long: EGM must not end by convergence.
  CONST egm_minmax mmNever:=[-1E-09,1E-09];

  ! Joint move to jWeldcellStart, between guidance poses and home.
  PROC WeldcellMove()
    nWeldcellState:=1;
    MoveAbsJ jWeldcellStart,v300,fine,tWeldcellHead;
    nWeldcellState:=2;
  ENDPROC

  ! Goes to jWeldcellStart by an ordinary fine move, then follows the joint references of weldcelld.
  PROC WeldcellScan()
    nWeldcellState:=1;
    MoveAbsJ jWeldcellStart,v300,fine,tWeldcellHead;
    nWeldcellState:=2;
    EGMReset egmWeldcell;
    WaitTime 0.005;
    EGMGetId egmWeldcell;
    EGMSetupUC ROB_1,egmWeldcell,"default","ROB_1"\Joint\CommTimeout:=0.5;
    EGMActJoint egmWeldcell\Tool:=tWeldcellHead\J1:=mmNever\J2:=mmNever\J3:=mmNever\J4:=mmNever\J5:=mmNever\J6:=mmNever\LpFilter:=100\SampleRate:=4\MaxSpeedDeviation:=90;
    nWeldcellState:=3;
    EGMRunJoint egmWeldcell,EGM_STOP_HOLD\J1\J2\J3\J4\J5\J6\CondTime:=1E+05\RampInTime:=0.05;
    EGMReset egmWeldcell;
    nWeldcellState:=4;
  ERROR
    ! The controller has already ramped the robot to rest. Nothing is tried again from here: weldcelld
    ! tells the operator and waits to be armed anew.
    IF ERRNO=ERR_UDPUC_COMM THEN
      nWeldcellState:=9;
      EGMReset egmWeldcell;
      TPWrite "weldcell: no data from the cell controller, scan ended";
      RETURN;
    ENDIF
  ENDPROC
ENDMODULE
