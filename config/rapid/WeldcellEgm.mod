MODULE WeldcellEgm
  ! Resident side of weldcell on an IRC5 controller (RobotWare 6.10 or later, option 689-1 EGM).
  ! weldcelld loads this module by itself over Robot Web Services whenever the controller's copy differs, and never
  ! while a program runs. docs/COMMISSIONING.md says what else the controller needs before the first use: the UDP
  ! device and the external motion data, both named weldcell, the user and his grants.
  !
  ! How weldcelld uses it: it writes jWeldcellStart, sets the program pointer to WeldcellMove or
  ! WeldcellScan, and starts with cycle=once. It reads nWeldcellState. WeldcellScan has no end of its
  ! own: it ends when weldcelld stops the program, by bWeldcellStop, or by time-out when weldcelld is silent.

  ! Where a move ends and a scan begins, degrees. Written by weldcelld.
  PERS jointtarget jWeldcellStart:=[[0,0,0,0,30,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];

  ! 0 idle, 1 moving to jWeldcellStart, 2 there and at rest, 3 following weldcelld over EGM,
  ! 4 EGM ended in order, 9 EGM ended because weldcelld fell silent. Read by weldcelld.
  PERS num nWeldcellState:=0;

  ! TRUE ends a scan in order from outside: the arm ramps to rest and stays. For the pendant, another RAPID task
  ! or a client of Robot Web Services; weldcelld itself stops the program.
  PERS bool bWeldcellStop:=FALSE;

  ! What the next four say comes from cell.yaml: weldcelld fills it in before it loads this module.
  ! Whole head on the flange, tool frame = flange: [holds, [frame], [kg, [centre of mass mm], [axes], inertia]].
  PERS tooldata tWeldcellHead:=[TRUE,[[0,0,0],[1,0,0,0]],[4.5,[0,0,100],[1,0,0,0],0,0,0]];
  ! egm.comm_timeout_s, egm.max_speed_deviation_deg_s, egm.low_pass_hz
  CONST num nWeldcellCommTimeout:=0.5;
  CONST num nWeldcellSpeedDeviation:=90;
  CONST num nWeldcellLowPass:=100;

  VAR egmident egmWeldcell;
  VAR intnum iWeldcellStop;
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
    bWeldcellStop:=FALSE;
    IDelete iWeldcellStop;
    CONNECT iWeldcellStop WITH WeldcellStop;
    IPers bWeldcellStop,iWeldcellStop;
    EGMReset egmWeldcell;
    WaitTime 0.005;
    EGMGetId egmWeldcell;
    EGMSetupUC ROB_1,egmWeldcell,"weldcell","weldcell"\Joint\CommTimeout:=nWeldcellCommTimeout;
    EGMActJoint egmWeldcell\Tool:=tWeldcellHead\J1:=mmNever\J2:=mmNever\J3:=mmNever\J4:=mmNever\J5:=mmNever\J6:=mmNever\LpFilter:=nWeldcellLowPass\SampleRate:=4\MaxSpeedDeviation:=nWeldcellSpeedDeviation;
    nWeldcellState:=3;
    EGMRunJoint egmWeldcell,EGM_STOP_HOLD\J1\J2\J3\J4\J5\J6\CondTime:=1E+05\RampInTime:=0.05;
    IDelete iWeldcellStop;
    EGMReset egmWeldcell;
    nWeldcellState:=4;
  ERROR
    ! The controller has already ramped the robot to rest. Nothing is tried again from here: weldcelld
    ! tells the operator and waits to be armed anew. The next scan needs no reset and no restart by hand.
    IF ERRNO=ERR_UDPUC_COMM THEN
      nWeldcellState:=9;
      IDelete iWeldcellStop;
      EGMReset egmWeldcell;
      TPWrite "weldcell: no data from the cell controller, scan ended";
      RETURN;
    ENDIF
  ENDPROC

  TRAP WeldcellStop
    IF bWeldcellStop THEN
      EGMStop egmWeldcell,EGM_STOP_HOLD;
    ENDIF
  ENDTRAP
ENDMODULE
