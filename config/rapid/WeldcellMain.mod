MODULE WeldcellMain
  ! Only for a motion task that has no routine main yet: it moves nothing, so that "PP to Main" and Start at the
  ! pendant do no harm. weldcelld sets the program pointer to its own routines and never calls this one.
  PROC main()
    TPWrite "weldcell: the robot is started by weldcelld";
  ENDPROC
ENDMODULE
